"""Web page on which a user draws boxes, and the local server of this page."""

import json
import os
import secrets
import sys
import threading
import webbrowser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from trackmark import datasets
from trackmark.bench.commands._drawing import ConflictError, Drawing, DrawingFiles
from trackmark.bench.commands._progress import print_message

PAGE = Path(__file__).with_name("_box_picker.html")
_FONT = Path(__file__).parents[1] / "pages/templates/inter.woff2"  # of the report page

_MAX_BYTES = 10_000_000  # limit of posted boxes; enough for 100,000 frames
_FPS = 25  # frame rate of images without one [frames/s]
_TEXT = "text/plain; charset=utf-8"


class BoxPicker(ThreadingHTTPServer):
    """Server of the page and the frames, for this machine only and at a random address.

    `note`: message that the page shows first.
    """

    daemon_threads = True  # a browser keeps unused connections open

    def __init__(self, sequence: datasets.Sequence, files: DrawingFiles, note: str = "") -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.sequence, self.files, self.note = sequence, files, note
        self.root = f"/{secrets.token_urlsafe(16)}/"
        self.url = f"http://127.0.0.1:{self.server_port}{self.root}"
        self.reading = threading.Lock()  # a sequence is read by one thread at a time

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore that a browser has closed its connection, as when a tab is closed or reloaded."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)

    def run(self) -> Drawing:
        """Serve until the user finishes; return what the user saved."""
        print_message(
            f"Draw boxes at {self.url} and press Finish there. Ctrl-C ends, too; unsaved changes "
            f"stay in {self.files.draft}."
        )
        # Without a display the browser would run in this terminal.
        display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if display or sys.platform in ("darwin", "win32"):
            webbrowser.open(self.url)
        self.serve_forever(poll_interval=0.1)
        return self.files.saved


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request."""

    server: BoxPicker

    def do_GET(self) -> None:
        """Send the page, its font, the boxes or a frame."""
        path = self._path_below_root()
        resource, _, frame = (path or "").partition("/")
        if path == "":
            self._respond(200, "text/html; charset=utf-8", PAGE.read_text("utf-8"))
        elif path == _FONT.name:
            self._respond(200, "font/woff2", _FONT.read_bytes())
        elif path == "state":
            self._send_state()
        elif resource == "frame" and frame.isdecimal() and len(frame) < 10:
            self._send_frame(int(frame))
        else:
            self._respond(404, _TEXT, "Not found.")

    def do_POST(self) -> None:
        """Receive boxes as draft or for the file; `finish` also stops the server."""
        action = self._path_below_root()
        length = self.headers.get("Content-Length", "")
        if action not in ("draft", "save", "finish"):
            self._respond(404, _TEXT, "Not found.")
        elif not (length.isascii() and length.isdecimal()):
            self._respond(411, _TEXT, "The length of the boxes is missing.")
        elif len(length) > 9 or int(length) > _MAX_BYTES:
            self._respond(413, _TEXT, "The boxes have more than 10 MB. Draw fewer.")
        else:
            self._keep(self.rfile.read(int(length)), action)

    def _path_below_root(self) -> str | None:
        """Return the path of the request after the secret root; None if it has another root."""
        root = self.server.root
        return self.path.removeprefix(root) if self.path.startswith(root) else None

    def _send_state(self) -> None:
        """Send the boxes; read them first if another program has changed the files."""
        files = self.server.files
        try:
            note, self.server.note = files.reload() or self.server.note, ""
        except (OSError, ValueError) as error:
            self._respond(400, _TEXT, _message(error))
            return
        state = {
            "video": files.video,
            "file": files.target.name,
            "frames": len(self.server.sequence),
            "fps": self.server.sequence.fps or _FPS,
            "saved": files.saved.model_dump(),
            "drawing": files.drawing.model_dump(),
            "note": note,
        }
        self._respond(200, "application/json", json.dumps(state))

    def _keep(self, posted: bytes, action: str) -> None:
        """Keep posted boxes; `If-Match` is the version on which they are based."""
        try:
            drawing = Drawing.model_validate_json(posted)
            message = self.server.files.keep(drawing, action, self.headers.get("If-Match"))
        except ConflictError as error:
            self._respond(412, _TEXT, str(error))
        except (OSError, ValueError) as error:
            self._respond(400, _TEXT, _message(error))
        else:
            self._respond(200, _TEXT, message)
            if action == "finish":
                self.server.shutdown()

    def _send_frame(self, frame: int) -> None:
        import cv2

        try:
            with self.server.reading:
                image = self.server.sequence[frame]
        except (IndexError, datasets.SequenceError) as error:
            self._respond(404, _TEXT, str(error))
            return
        self._respond(200, "image/jpeg", cv2.imencode(".jpg", image)[1].tobytes())

    def _respond(self, status: int, content_type: str, body: str | bytes) -> None:
        # A file name can contain bytes that are not UTF-8.
        encoded = body.encode(errors="replace") if isinstance(body, str) else body
        self.send_response(status)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(len(encoded)))
        self.send_header("ETag", str(self.server.files.version))
        self.end_headers()
        self.wfile.write(encoded)

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002  # name in the base class
        """Print nothing."""


def _message(error: OSError | ValueError) -> str:
    """Return the reason why boxes cannot be kept or read."""
    if isinstance(error, OSError):
        return f"{error.filename}: {error.strerror}."
    if isinstance(error, ValidationError):
        return "Invalid boxes. Expected: [x, y, width, height] by frame."
    return str(error)
