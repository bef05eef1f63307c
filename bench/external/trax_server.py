"""Server that lets clients of TraX, such as vot-toolkit, run a tracker of trackmark.

It writes version 4 of the protocol (see `bench.external.trax`), reads images by path, and answers
with rectangles. The state of a frame has the property `confidence` if the tracker returns one.
"""

from collections.abc import Callable, Iterable, Iterator
from math import isnan, nan
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote

from trackmark.bench.external.plugin import ExternalPlugin
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
    answers.write(format_message("hello", **properties))
    try:
        for answer in _states(make, requests):
            answers.write(answer)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        answers.write(format_message("quit", **{"trax.reason": reason[:MAX_REASON]}))
        raise


def _states(make: Callable[[], Tracker], requests: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the message with the state of the tracker for each frame, until `quit`."""
    tracker, region = None, ""
    for line in requests:
        if MARK not in line:
            continue
        request = parse_message(line)
        if request.name == "quit":
            return
        if request.name == "initialize" and request.values:
            region = request.values[-1]  # the image comes with the next `frame`
            continue
        if request.name != "frame" or not request.values:
            text = line.decode(errors="replace")[:80]
            raise TrackerError(f"the client sent {text!r}. Expected: initialize or frame.")
        image = _read_image(request.values[0])
        confidence = nan
        if region:
            if isinstance(tracker, ExternalPlugin):
                tracker.close()  # its process serves the next one
            tracker = make()
            box, mask = parse_region(region, image.shape)
            if box is None:
                raise TrackerError(f"the client initialises with {region!r}: no target.")
            tracker.init(image, box, mask)
            region = ""
        elif tracker is None:
            raise TrackerError("the client sent a frame before initialize.")
        else:
            estimate = tracker.update(image)
            box, confidence = check_box(estimate.box), float(estimate.confidence)
        properties = {} if isnan(confidence) else {"confidence": confidence}
        yield format_message("state", format_region(["rectangle"], box), **properties)


def _read_image(address: str) -> Image:
    """Return the image of a path or a `file:` address."""
    path = Path(address.removeprefix("file://"))
    # vot-trax does not encode special characters; other clients do.
    file = path if path.exists() else Path(unquote(str(path)))
    return decode_image(file.read_bytes())
