"""Boxes that are drawn by hand, on a page that is served to a browser of this machine alone."""

import json
import os
import secrets
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import click

from trackmark import datasets

Boxes = dict[int, list[float]]
"""`[x, y, width, height]` in pixels, by frame."""

PAGE = Path(__file__).with_name("_box_picker.html")

_LONGEST_ANSWER = 10_000_000  # bytes: boxes of a hundred thousand frames


def pick_boxes(
    sequence: datasets.Sequence, marked: Mapping[int, list[float]], check: Callable[[Boxes], object]
) -> Boxes:
    """Return the boxes that the user draws in a browser, from `marked` on, if `check` accepts."""
    with _Server(sequence, marked, check) as server:
        click.echo(f"Draw boxes at {server.url} and press Done there. Ctrl-C gives up.", err=True)
        if _has_display():
            webbrowser.open(server.url)
        server.serve_forever(poll_interval=0.1)
        return server.picked


def _has_display() -> bool:
    """Whether a browser has a place for a window; else it would take the terminal."""
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(shown) or sys.platform in ("darwin", "win32")


class _Server(ThreadingHTTPServer):
    """Serves the page, the frames, and takes the boxes.

    It listens on this machine alone, and answers no one who doesn't know its address.
    """

    daemon_threads = True  # a browser keeps connections open that it doesn't use

    def __init__(
        self,
        sequence: datasets.Sequence,
        marked: Mapping[int, list[float]],
        check: Callable[[Boxes], object],
    ) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.sequence = sequence
        self.state = {"frames": len(sequence), "boxes": dict(marked)}
        self.check = check
        self.picked: Boxes = {}
        self.root = f"/{secrets.token_urlsafe(16)}/"
        self.url = f"http://127.0.0.1:{self.server_port}{self.root}"
        self.reading = threading.Lock()  # frames are read by one at a time


class _Handler(BaseHTTPRequestHandler):
    """Answers a request."""

    server: _Server

    def do_GET(self) -> None:
        """The page, or a frame of it."""
        asked = self.path.removeprefix(self.server.root)
        kind, _, number = asked.partition("/")
        if asked == self.path:
            self._answer(404, "text/plain", b"There is nothing here.")
        elif not asked:
            # Nothing in it can end the script that it stands in: these are numbers.
            page = PAGE.read_text("utf-8").replace("STATE", json.dumps(self.server.state))
            self._answer(200, "text/html; charset=utf-8", page.encode())
        elif kind == "frame" and number.isdecimal() and len(number) < 10:
            self._send_frame(int(number))
        else:
            self._answer(404, "text/plain", b"There is nothing here.")

    def do_POST(self) -> None:
        """The boxes: kept where they will do, which ends the serving."""
        length = self.headers.get("Content-Length", "")
        if self.path != f"{self.server.root}done" or not length.isdecimal():
            self._answer(404, "text/plain", b"There is nothing here.")
        elif len(length) > 9 or int(length) > _LONGEST_ANSWER:
            self._answer(413, "text/plain", b"These are too many boxes.")
        else:
            try:
                boxes = _boxes(json.loads(self.rfile.read(int(length))))
                self.server.check(boxes)
            except (ValueError, RecursionError) as error:
                self._answer(400, "text/plain; charset=utf-8", str(error).encode())
                return
            self.server.picked = boxes
            self._answer(200, "text/plain", b"Kept. You may close this page.")
            self.server.shutdown()

    def _send_frame(self, number: int) -> None:
        import cv2

        try:
            with self.server.reading:
                image = self.server.sequence[number]
        except (IndexError, datasets.SequenceError) as error:
            self._answer(404, "text/plain; charset=utf-8", str(error).encode())
            return
        self._answer(200, "image/jpeg", cv2.imencode(".jpg", image)[1].tobytes())

    def _answer(self, status: int, kind: str, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002  # as its base says
        """Say nothing of each request."""


def _boxes(answer: Any) -> Boxes:
    """Return the boxes that the page sent, or raise `ValueError` if they are malformed."""
    if not isinstance(answer, dict):
        raise ValueError("boxes by frame are expected.")  # noqa: TRY004  # an error of the sender
    boxes: Boxes = {}
    for frame, box in answer.items():
        numbers = isinstance(box, list) and all(type(value) in (int, float) for value in box)
        if not (frame.isdecimal() and len(frame) < 10 and numbers and len(box) == 4):
            raise ValueError("a box is four numbers, x y width height, of a frame.")
        boxes[int(frame)] = [float(value) for value in box]
    return boxes
