"""Web page on which a user draws boxes, and the local server of this page."""

import json
import os
import secrets
import sys
import threading
import webbrowser
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from trackmark import datasets
from trackmark.bench.commands._progress import print_message
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.reports.files import write_file

PAGE = Path(__file__).with_name("_box_picker.html")

_MAX_BYTES = 10_000_000  # limit of posted boxes; enough for 100,000 frames
_TEXT = "text/plain; charset=utf-8"


class Drawing(BaseModel):
    """Boxes `[x, y, width, height]` of key frames [pixels], and intervals without the target."""

    boxes: dict[int, Annotated[list[float], Field(min_length=4, max_length=4)]] = {}
    absent: list[tuple[int, int]] = []  # first and last frame, both included


def read_draft(draft: Path) -> Drawing | None:
    """Return the drawing in a file of unsaved changes, None if there is no such file."""
    try:
        return Drawing.model_validate_json(draft.read_bytes()) if draft.exists() else None
    except ValidationError:
        raise ExperimentError(f"{draft}: not a draft of annotate. Delete the file.") from None


class BoxPicker(ThreadingHTTPServer):
    """Server of the page and the frames, for this machine only and at a random address.

    `saved`: content of the file `target`; `drawing`: what the page shows first. `draft`: file of
    unsaved changes. `save` writes the file `target`, or raises `OSError` or `ValueError`.
    """

    daemon_threads = True  # a browser keeps unused connections open

    def __init__(
        self,
        sequence: datasets.Sequence,
        target: Path,
        draft: Path,
        saved: Drawing,
        drawing: Drawing,
        save: Callable[[Drawing], object],
    ) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.sequence, self.saved, self.drawing, self.save = sequence, saved, drawing, save
        self.target, self.draft = target, draft
        self.root = f"/{secrets.token_urlsafe(16)}/"
        self.url = f"http://127.0.0.1:{self.server_port}{self.root}"
        self.reading = threading.Lock()  # a sequence is read by one thread at a time

    def run(self) -> Drawing:
        """Serve until the user finishes; return what the user saved."""
        print_message(
            f"Draw boxes at {self.url} and press Finish there. Ctrl-C ends, too; unsaved changes "
            f"stay in {self.draft}."
        )
        # Without a display the browser would run in this terminal.
        display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if display or sys.platform in ("darwin", "win32"):
            webbrowser.open(self.url)
        self.serve_forever(poll_interval=0.1)
        return self.drawing

    def keep(self, drawing: Drawing, action: str) -> str:
        """Write the draft or the file itself; return a message for the page."""
        self.drawing = drawing
        if action != "draft":
            self.save(drawing)
            self.saved = drawing
        if drawing == self.saved:
            self.draft.unlink(missing_ok=True)
        else:
            content = drawing.model_dump_json().encode()
            write_file(self.draft, lambda file: file.write_bytes(content))
        if action == "draft":
            return ""
        end = ". You can close this page" if action == "finish" else ""
        return f"Saved {len(drawing.boxes)} key frames to {self.target.name}{end}."


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request."""

    server: BoxPicker

    def do_GET(self) -> None:
        """Send the page, the boxes or a frame."""
        path = self.path.removeprefix(self.server.root)  # begins with / if the root is another
        kind, _, number = path.partition("/")
        if not path:
            self._answer(200, "text/html; charset=utf-8", PAGE.read_text("utf-8"))
        elif path == "state":
            state = {
                "name": self.server.target.name,
                "frames": len(self.server.sequence),
                "saved": self.server.saved.model_dump(),
                "drawing": self.server.drawing.model_dump(),
            }
            self._answer(200, "application/json", json.dumps(state))
        elif kind == "frame" and number.isdecimal() and len(number) < 10:
            self._send_frame(int(number))
        else:
            self._answer(404, _TEXT, "Not found.")

    def do_POST(self) -> None:
        """Receive boxes as draft or for the file; `finish` also stops the server."""
        action = self.path.removeprefix(self.server.root)
        length = self.headers.get("Content-Length", "")
        if action not in ("draft", "save", "finish") or not length.isdecimal():
            self._answer(404, _TEXT, "Not found.")
            return
        if len(length) > 9 or int(length) > _MAX_BYTES:
            self._answer(413, _TEXT, "The boxes have more than 10 MB. Draw fewer.")
            return
        try:
            drawing = Drawing.model_validate_json(self.rfile.read(int(length)))
            status, text = 200, self.server.keep(drawing, action)
        except ValidationError:
            status, text = 400, "Invalid boxes. Expected: [x, y, width, height] by frame."
        except OSError as error:
            status, text = 400, f"{error.filename}: {error.strerror}."
        except ValueError as error:
            status, text = 400, str(error)
        self._answer(status, _TEXT, text)
        if action == "finish" and status == 200:
            self.server.shutdown()

    def _send_frame(self, number: int) -> None:
        import cv2

        try:
            with self.server.reading:
                image = self.server.sequence[number]
        except (IndexError, datasets.SequenceError) as error:
            self._answer(404, _TEXT, str(error))
            return
        self._answer(200, "image/jpeg", cv2.imencode(".jpg", image)[1].tobytes())

    def _answer(self, status: int, kind: str, content: str | bytes) -> None:
        # A file name can contain bytes that are not UTF-8.
        data = content.encode(errors="replace") if isinstance(content, str) else content
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002  # name in the base class
        """Print nothing."""
