"""Server that lets clients of TraX, such as vot-toolkit, run a tracker of trackmark.

It writes version 4 of the protocol (see `bench.external.trax`), reads images by path, and answers
with rectangles. The state of a frame has the property `confidence` if the tracker returns one.
"""

from collections.abc import Callable, Iterable
from math import isnan
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote

from trackmark.bench.external.trax import (
    MARK,
    format_message,
    format_region,
    parse_message,
    parse_region,
)
from trackmark.datasets.image_files import decode_image
from trackmark.trackers import Image, Tracker, TrackerError
from trackmark.trackers.base.interface import check_box

MAX_REASON = 500
"""Maximum length of the reason of a failure [characters]."""

FORMATS = {"image": "path;", "region": "rectangle;", "channels": "color;"}


def serve(
    make: Callable[[], Tracker], name: str, requests: Iterable[bytes], answers: BinaryIO
) -> None:
    """Answer the requests of a client until it sends `quit`, or until its messages end.

    Each `initialize` creates a new tracker with `make`. `name` is sent as the tracker's name.

    Raises `TrackerError` for an invalid request or estimate, and exceptions of the tracker. The
    client gets the reason before.
    """
    hello = {"version": 4, "name": name, "identifier": name, "family": "trackmark", **FORMATS}
    properties = {f"trax.{key}": value for key, value in hello.items()}
    answers.write(format_message("hello", properties=properties))
    session = _Session(make)
    try:
        for line in requests:
            if MARK in line:
                answer = session.answer(line)
                if answer is None:
                    return
                answers.write(answer)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        answers.write(format_message("quit", properties={"trax.reason": reason[:MAX_REASON]}))
        raise


class _Session:
    """Conversation with a client: the current tracker, and the region of `initialize`.

    In version 4 of the protocol, the image of an initialisation comes with the next `frame`.
    """

    def __init__(self, make: Callable[[], Tracker]) -> None:
        self._make, self._region = make, ""
        self._tracker: Tracker | None = None

    def answer(self, line: bytes) -> bytes | None:
        """Return the answer to a request, which can be empty; None for `quit`."""
        request = parse_message(line)
        if request.name == "quit":
            return None
        if request.name == "initialize" and request.values:
            self._region = request.values[-1]
            return b""
        if request.name == "frame" and request.values:
            return self._state(_read_image(request.values[0]))
        text = line.decode(errors="replace")[:80]
        raise TrackerError(f"the client sent {text!r}. Expected: initialize or frame.")

    def _state(self, image: Image) -> bytes:
        """Initialise or update the tracker; return the message with its state."""
        properties: dict[str, object] = {}
        if self._region:
            box, mask = parse_region(self._region, image.shape)
            if box is None:
                raise TrackerError(f"the client initialises with {self._region!r}: no target.")
            self._region, self._tracker = "", self._make()
            self._tracker.init(image, box, mask)
        elif self._tracker is None:
            raise TrackerError("the client sent a frame before initialize.")
        else:
            estimate = self._tracker.update(image)
            box = check_box(estimate.box)
            if not isnan(estimate.confidence):
                properties["confidence"] = float(estimate.confidence)
        return format_message("state", format_region(["rectangle"], box), properties=properties)


def _read_image(address: str) -> Image:
    """Return the image of a path or a `file:` address."""
    path = Path(address.removeprefix("file://"))
    # vot-trax does not encode special characters; other clients do.
    file = path if path.exists() else Path(unquote(str(path)))
    return decode_image(file.read_bytes())
