"""Server that lets clients of TraX, such as vot-toolkit, run a tracker of trackmark.

It writes version 4 of the protocol (see `bench.external.trax`), reads images by path, and answers
with rectangles. The state of a frame has the property `confidence` if the tracker returns one.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from math import isnan, nan
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote

import numpy as np

from trackmark.bench.external.plugin import RemoteTracker
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.external.trax import (
    MARK,
    format_message,
    format_region,
    parse_message,
    parse_region,
)
from trackmark.datasets.image_files import decode_image, read_image_file
from trackmark.trackers import Image, Mask, Tracker, TrackerError
from trackmark.trackers.base.estimate_check import MalformedEstimateError, read_box, read_estimate

MAX_REASON = 500
"""Maximum length of the reason of a failure [characters]."""

FORMATS = {"image": "path;", "region": "rectangle;", "channels": "color;"}


class ClientError(TrackerError):
    """Mistake of a client: an invalid request, region or image."""


def serve_client(
    make: Callable[[], Tracker], name: str, requests: Iterable[bytes], answers: BinaryIO
) -> None:
    """Answer the requests of a client until it sends `quit`, or until its messages end.

    Each `initialize` creates a new tracker with `make`. `name` is sent as the tracker's name.

    Raises `ClientError` for an invalid request, `TrackerError` for an invalid estimate, and
    exceptions of the tracker. The client gets the reason before.
    """
    hello = {"version": 4, "name": name, "identifier": name, "family": "trackmark", **FORMATS}
    properties = {f"trax.{key}": value for key, value in hello.items()}
    _write(answers, format_message("hello", **properties))
    try:
        for reply in _states(make, requests):
            _write(answers, reply)
    except Exception as error:
        is_known = type(error) in (ClientError, ExternalTrackerError, TrackerError)
        reason = str(error) if is_known else f"{type(error).__name__}: {error}"
        with suppress(ClientError):  # the reason of the end may be that the client is gone
            _write(answers, format_message("quit", **{"trax.reason": reason[:MAX_REASON]}))
        raise


def _write(answers: BinaryIO, message: bytes) -> None:
    try:
        answers.write(message)
    except OSError as error:
        raise ClientError(f"the client cannot be answered: {error.strerror}.") from None


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
            received = line.decode(errors="replace").strip()[:80]
            raise ClientError(f"the client sent {received!r}. Expected: initialize or frame.")
        image = _read_image(request.values[0])
        confidence = nan
        if region:
            if isinstance(tracker, RemoteTracker):
                tracker.close()  # its process serves the next one
            box, mask = _parse_init(region, image.shape)
            tracker = make()
            tracker.init(image, np.array(box), mask)
            region = ""
        elif tracker is None:
            raise ClientError("the client sent a frame before initialize.")
        else:
            try:
                fields = read_estimate(tracker.update(image), image.shape)
            except MalformedEstimateError as error:
                raise TrackerError(f"{error}.") from None
            box, confidence = fields["box"] or box, fields["confidence"]
        properties = {} if isnan(confidence) else {"confidence": confidence}
        yield format_message("state", format_region(["rectangle"], np.array(box)), **properties)


def _parse_init(region: str, shape: tuple[int, ...]) -> tuple[list[float], Mask | None]:
    """Return box and mask of the region with which a client initialises the tracker."""
    try:
        box, mask = parse_region(region, shape)
        init_box = None if box is None else read_box(box, no_target=True)
    except ValueError:
        raise ClientError(
            f"the client initialises with {region[:80]!r}. Expected: finite numbers of a "
            "rectangle, a polygon or a mask, with width and height above 0."
        ) from None
    if init_box is None:
        raise ClientError(f"the client initialises with {region[:80]!r}: no target.")
    return init_box, mask


def _read_image(address: str) -> Image:
    """Return the image of a path or a `file:` address."""
    path = Path(address.removeprefix("file://"))
    try:
        # vot-trax does not encode special characters; other clients do.
        file = path if path.exists() else Path(unquote(str(path)))
        return decode_image(read_image_file(file))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ClientError(
            f"the image {address[:200]!r} of the client cannot be read: {reason}. Expected: the "
            "path of an image."
        ) from None
