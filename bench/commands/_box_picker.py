"""Web page on which a user draws boxes, and the local server of this page."""

import json
import os
import secrets
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from trackmark import datasets
from trackmark.bench.commands._progress import print_message

Boxes = dict[int, list[float]]
"""`[x, y, width, height]` in pixels, by frame."""

PAGE = Path(__file__).with_name("_box_picker.html")

_Frame = Annotated[int, Field(ge=0, lt=10**9)]
_Box = Annotated[list[float], Field(min_length=4, max_length=4)]
_BOXES = TypeAdapter(dict[_Frame, _Box])
_MAX_BYTES = 10_000_000  # limit of posted boxes; enough for 100,000 frames
_TEXT = "text/plain; charset=utf-8"


def pick_boxes(
    sequence: datasets.Sequence, marked: Mapping[int, list[float]], check: Callable[[Boxes], object]
) -> Boxes:
    """Return the boxes that the user draws in a browser, starting from `marked`.

    `check`: raises `ValueError` for boxes that are not accepted.
    """
    with _Server(sequence, marked, check) as server:
        print_message(f"Draw boxes at {server.url} and press Done there. Ctrl-C cancels.")
        # Without a display the browser would run in this terminal.
        display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if display or sys.platform in ("darwin", "win32"):
            webbrowser.open(server.url)
        server.serve_forever(poll_interval=0.1)
        return server.picked


class _Server(ThreadingHTTPServer):
    """Server of the page and the frames, for this machine only and at a random address."""

    daemon_threads = True  # a browser keeps unused connections open

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
        self.reading = threading.Lock()  # a sequence is read by one thread at a time


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request."""

    server: _Server

    def do_GET(self) -> None:
        """Send the page, or a frame."""
        path = self.path.removeprefix(self.server.root)
        kind, _, number = path.partition("/")
        if path == self.path:
            self._answer(404, _TEXT, b"Not found.")
        elif not path:
            # The state has only numbers: no text in it can end the script element.
            page = PAGE.read_text("utf-8").replace("STATE", json.dumps(self.server.state))
            self._answer(200, "text/html; charset=utf-8", page.encode())
        elif kind == "frame" and number.isdecimal() and len(number) < 10:
            self._send_frame(int(number))
        else:
            self._answer(404, _TEXT, b"Not found.")

    def do_POST(self) -> None:
        """Receive the boxes; stop the server if they are valid."""
        length = self.headers.get("Content-Length", "")
        if self.path != f"{self.server.root}done" or not length.isdecimal():
            self._answer(404, _TEXT, b"Not found.")
        elif len(length) > 9 or int(length) > _MAX_BYTES:
            self._answer(413, _TEXT, b"The boxes have more than 10 MB. Draw fewer.")
        else:
            try:
                boxes = _BOXES.validate_json(self.rfile.read(int(length)))
                self.server.check(boxes)
            except ValidationError:
                self._answer(
                    400, _TEXT, b"Invalid boxes. Expected: [x, y, width, height] by frame."
                )
                return
            except ValueError as error:
                self._answer(400, _TEXT, str(error).encode())
                return
            self.server.picked = boxes
            self._answer(200, _TEXT, b"Boxes received. You can close this page.")
            self.server.shutdown()

    def _send_frame(self, number: int) -> None:
        import cv2

        try:
            with self.server.reading:
                image = self.server.sequence[number]
        except (IndexError, datasets.SequenceError) as error:
            self._answer(404, _TEXT, str(error).encode())
            return
        self._answer(200, "image/jpeg", cv2.imencode(".jpg", image)[1].tobytes())

    def _answer(self, status: int, kind: str, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002  # name in the base class
        """Print nothing."""
