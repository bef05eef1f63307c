"""Client of trackers that speak TraX, the protocol of the VOT challenge, on stdin and stdout.

Versions 1 to 4 of the protocol are supported, with one object and colour images. Specification:
https://trax.readthedocs.io. `TraxTracker` starts the tracker and has the interface of `Tracker`.
A tracker that reads images from files gets the name of one uncompressed file in memory, which is
overwritten for each frame.
"""

import base64
import os
import re
import shlex
import tempfile
import weakref
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.bench.external.process import (
    FRAME_SECONDS,
    START_SECONDS,
    ExternalTrackerError,
    LineProcess,
    frame_file_options,
)
from trackmark.trackers import Box, Estimate, Image, Mask

MARK = b"@@TRAX:"
"""Start of each message; lines without it are output of the tracker."""

QUIT_SECONDS = 2.0
"""Time that a tracker has to end after the message `quit` [s]."""

_ARGUMENT = re.compile(r'"((?:[^"\\]|\\.)*)"|(\S+)')
_KEY = re.compile(r"[\w.]{1,64}", re.ASCII)
_MAX_MASK_PIXELS = 1 << 26
_BMP_HEADER = 54  # bytes


class Message(NamedTuple):
    """Message of the protocol: its name, and its arguments without and with a key."""

    name: str
    values: list[str]
    properties: dict[str, str]


def parse_message(line: bytes) -> Message:
    """Return the message of a line that contains `MARK`.

    >>> parse_message(b'@@TRAX:state "1,2,3,4" "confidence=0.5"')
    Message(name='state', values=['1,2,3,4'], properties={'confidence': '0.5'})
    """
    text = line.partition(MARK)[2].decode(errors="replace").strip()
    name, _, rest = text.partition(" ")
    message = Message(name, [], {})
    for quoted, bare in _ARGUMENT.findall(rest):
        argument = re.sub(r"\\(.)", _unescape, quoted) if quoted else bare
        key, equals, value = argument.partition("=")
        if equals and _KEY.fullmatch(key):
            message.properties[key] = value
        else:
            message.values.append(argument)
    return message


def _unescape(match: re.Match[str]) -> str:
    return "\n" if match[1] == "n" else match[1]


def format_message(
    name: str, *values: str, properties: Mapping[str, object] | None = None
) -> bytes:
    r"""Return the line of a message.

    >>> format_message("frame", "file:///tmp/1.bmp")
    b'@@TRAX:frame "file:///tmp/1.bmp"\n'
    """
    arguments = [*values, *(f"{key}={value}" for key, value in (properties or {}).items())]
    escaped = (re.sub(r'(["\\])', r"\\\1", text).replace("\n", "\\n") for text in arguments)
    return MARK + " ".join([name, *(f'"{text}"' for text in escaped)]).encode() + b"\n"


def split_list(text: str) -> list[str]:
    """Return the items of a list such as `path;memory;`."""
    return [item for item in re.split("[;,]", text) if item]


def parse_region(text: str, shape: tuple[int, ...]) -> tuple[Box | None, Mask | None]:
    """Return the box and the mask of a region.

    A polygon gives its bounding box; only a mask gives a mask, cropped to the image. The box is
    None for an empty mask and for a special region, a single number such as "0": no target.

    `shape`: (height, width) of the image.

    Raises `ValueError` for a malformed region, and for numbers that are not finite.
    """
    if text.startswith("mask:"):
        return _parse_mask(text.removeprefix("mask:"), shape)
    numbers = np.array([float(number) for number in split_list(text)])
    if not len(numbers) or not np.isfinite(numbers).all():
        raise ValueError(text)
    if len(numbers) == 4:
        return numbers, None
    if len(numbers) == 1:
        return None, None
    if len(numbers) < 6:
        raise ValueError(text)
    points = numbers.reshape(-1, 2)
    return np.concatenate([points.min(axis=0), np.ptp(points, axis=0)]), None


def _parse_mask(text: str, shape: tuple[int, ...]) -> tuple[Box | None, Mask]:
    """Return box and mask of `x,y,width,height` and lengths of runs of 0 and 1 in turn, by row."""
    x, y, width, height, *runs = (int(number) for number in split_list(text))
    size = width * height
    if min(width, height, *runs, 0) < 0 or max(size, sum(runs)) > _MAX_MASK_PIXELS:
        raise ValueError(text)
    pixels = np.zeros(size, np.bool_)
    ends = np.cumsum(runs)
    for start, stop in zip(ends[::2], ends[1::2], strict=False):
        pixels[start:stop] = True
    mask = np.zeros(shape[:2], np.bool_)
    top, left = max(0, -y), max(0, -x)
    part = pixels.reshape(height, width)[top:, left:]
    target = mask[max(0, y) :, max(0, x) :][: part.shape[0], : part.shape[1]]
    target[...] = part[: target.shape[0], : target.shape[1]]
    return bounding_box(mask), mask


def bounding_box(mask: Mask) -> Box | None:
    """Return the box of a mask's pixels; None for an empty mask."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return None
    x, y = columns[0], rows[0]
    return np.array([x, y, columns[-1] + 1 - x, rows[-1] + 1 - y], np.float64)


def format_region(formats: Collection[str], box: Box, mask: Mask | None = None) -> str:
    """Return a region in one of the formats that a tracker reads.

    A mask is used if the tracker reads masks and `mask` is not None; otherwise, the box becomes a
    rectangle, a polygon or, if the tracker reads nothing else, a mask. Numbers are exact.
    """
    x, y, width, height = (float(number) for number in box)
    if "mask" in formats and (mask is not None or not {"rectangle", "polygon"} & set(formats)):
        return _format_mask(box, mask)
    if "polygon" in formats and "rectangle" not in formats:
        corners = [x, y, x + width, y, x + width, y + height, x, y + height]
        return ",".join(map(repr, corners))
    return ",".join(map(repr, [x, y, width, height]))


def _format_mask(box: Box, mask: Mask | None) -> str:
    if mask is not None and (bounds := bounding_box(mask)) is not None:
        box = bounds
    x, y, width, height = (round(float(number)) for number in box)
    if mask is None:
        part: NDArray[np.bool_] = np.ones((max(1, height), max(1, width)), np.bool_)
    else:
        part = mask[y : y + height, x : x + width]
    edges = np.flatnonzero(np.diff(part.ravel(), prepend=False))  # the first run has zeros
    runs = np.diff(edges, prepend=0, append=part.size)
    return "mask:" + ",".join(map(str, [x, y, part.shape[1], part.shape[0], *runs.tolist()]))


@dataclass(frozen=True)
class TraxCommand:
    """Command of a tracker that speaks TraX.

    `command` is the program with its arguments, `folder` its working directory. `environment` has
    variables in addition to those of this process. `confidence` is false if confidences are
    ignored. `start_seconds` limits the start and the initialisation, `frame_seconds` an update.
    `digest` identifies the content of the command's files.
    """

    command: tuple[str, ...]
    environment: tuple[tuple[str, str], ...] = ()
    folder: Path | None = None
    confidence: bool = True
    start_seconds: float = START_SECONDS
    frame_seconds: float = FRAME_SECONDS
    digest: str = ""


class TraxTracker:
    """Tracker in a process that speaks TraX.

    `hello` holds the properties that the tracker sent at its start, such as `trax.name`.

    Raises `ExternalTrackerError`, here and in all methods, if the process ends, exceeds a time
    limit, or sends an invalid message. The error contains the command and the end of the output.
    """

    def __init__(self, command: TraxCommand) -> None:
        self._command = command
        environment = {"TRAX": "1", **dict(command.environment)}  # as vot-toolkit
        self._process = LineProcess(command.command, environment=environment, folder=command.folder)
        message = self._receive("hello", seconds=command.start_seconds)
        self.hello = message.properties
        version = self.hello.get("trax.version", "1")
        if version not in ("1", "2", "3", "4"):
            raise self._process.fail(f"uses version {version!r} of TraX. Expected: 1 to 4")
        self._image_comes_later = version == "4"  # in `frame`; before version 4 in `initialize`
        self._image_formats = self._formats("trax.image", "path")
        self._region_formats = self._formats("trax.region", "rectangle")
        if not {"path", "memory", "data", "buffer"} & set(self._image_formats):
            raise self._process.fail(
                f"reads images by {self._image_formats}. Expected: path, memory or buffer"
            )
        channels = self._formats("trax.channels", "color")
        if channels != ["color"]:
            raise self._process.fail(f"reads the image channels {channels}. Expected: color")
        descriptor, name = tempfile.mkstemp(**frame_file_options(), suffix=".bmp")
        os.close(descriptor)
        self._file = Path(name)
        self._delete_file = weakref.finalize(self, self._file.unlink, missing_ok=True)
        self._rows: NDArray[np.uint8] = np.empty((0, 0), np.uint8)  # pixels in the file
        self._box: Box

    def init(
        self,
        image: Image,
        box: Box,
        mask: Mask | None = None,
        properties: Mapping[str, object] | None = None,
    ) -> None:
        """See `Tracker.init`. `properties` are sent to the tracker; most trackers ignore them."""
        region = format_region(self._region_formats, box, mask)
        address = self._show(image)
        values = [region] if self._image_comes_later else [address, region]
        request = format_message("initialize", *values, properties=properties)
        if self._image_comes_later:
            request += format_message("frame", address)
        self._box = box
        self._ask(request, image, self._command.start_seconds)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`.

        If the tracker reports no target (see `parse_region`), the estimate has the last box and is
        not visible.
        """
        request = format_message("frame", self._show(image))
        box, mask, properties = self._ask(request, image, self._command.frame_seconds)
        if box is not None:
            self._box = box
        return Estimate(
            self._box.copy(),
            visible=box is not None,
            confidence=self._confidence(properties),
            mask=mask,
        )

    def close(self) -> None:
        """End the tracker's process."""
        if not self._process.closed:
            with suppress(ExternalTrackerError):  # the process has ended by itself
                self._process.send(format_message("quit"), QUIT_SECONDS)
        self._process.close(QUIT_SECONDS)
        self._delete_file()

    def _formats(self, key: str, default: str) -> list[str]:
        return split_list(self.hello.get(key, "")) or [default]

    def _receive(self, *names: str, seconds: float) -> Message:
        """Return the tracker's next message, which must have one of the names."""
        line = self._process.read_line(seconds, MARK)
        message = parse_message(line)
        if message.name == "quit":
            reason = message.properties.get("trax.reason", "no reason given")
            raise self._process.fail(f"ended the session: {reason}")
        if message.name not in names:
            text = line.decode(errors="replace")[:80]
            raise self._process.fail(f"sent {text!r}. Expected: the message {names[0]!r}")
        return message

    def _show(self, image: Image) -> str:
        """Return the argument that passes an image to the tracker."""
        if "path" in self._image_formats:
            self._write(image)
            return f"file://{self._file}"
        if "memory" in self._image_formats:
            data = base64.b64encode(image[:, :, ::-1].tobytes()).decode()  # RGB
            return f"image:{image.shape[1]};{image.shape[0]};rgb;{data}"
        _, png = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        return f"data:image/png;{base64.b64encode(png.tobytes()).decode()}"

    def _write(self, image: Image) -> None:
        """Write an image to the file; only the first image of a size needs an encoder."""
        height, width = image.shape[:2]
        if self._rows.shape != (height, 3 * width):
            if not cv2.imwrite(str(self._file), image):
                raise OSError(f"{self._file}: the image cannot be written. Is the disk full?")
            stride = -(-3 * width // 4) * 4
            rows = np.memmap(self._file, np.uint8, "r+", offset=_BMP_HEADER, shape=(height, stride))
            self._rows = rows[::-1, : 3 * width]  # the file starts with the last row
        self._rows[...] = image.reshape(height, -1)

    def _ask(
        self, request: bytes, image: Image, seconds: float
    ) -> tuple[Box | None, Mask | None, Mapping[str, str]]:
        """Send a request; return box, mask and properties of the answer."""
        self._process.send(request, seconds)
        # vot-trax of some versions calls the answer `status`.
        message = self._receive("state", "status", seconds=seconds)
        region = message.values[0] if message.values else ""
        try:
            box, mask = parse_region(region, image.shape)
        except ValueError:
            raise self._process.fail(
                f"answered with the region {region[:80]!r}. Expected: finite numbers, as a "
                "rectangle, a polygon or a mask"
            ) from None
        return box, mask, message.properties

    def _confidence(self, properties: Mapping[str, str]) -> float:
        """Return the confidence of an answer; NaN if it has none or confidences are ignored."""
        text = properties.get("confidence", "nan") if self._command.confidence else "nan"
        try:
            confidence = float(text)
        except ValueError:
            confidence = -1.0
        if not (0.0 <= confidence <= 1.0 or isnan(confidence)):
            raise self._process.fail(
                f"answered with the confidence {text[:80]!r}. Expected: a number from 0 to 1. Add "
                "confidence=false to the specification to ignore confidences"
            )
        return confidence


class TraxPlugin(ExternalPlugin):
    """Plugin of a tracker that speaks TraX; see `load_plugin`."""

    includes_transfer = True
    command: ClassVar[TraxCommand]

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        key = os.getpid(), self.command
        self._tracker = _unused.pop(key) if key in _unused else TraxTracker(self.command)

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        began = perf_counter()
        self._tracker.init(image, box, mask, self.parameters.model_dump())
        self.call_times = (perf_counter() - began,) * 2

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        began = perf_counter()
        estimate = self._tracker.update(image)
        self.call_times = (perf_counter() - began,) * 2
        return estimate

    def close(self) -> None:
        """See `ExternalPlugin.close`."""
        self._tracker.close()


_greetings: dict[TraxCommand, Mapping[str, str]] = {}
"""Properties of `hello`, by command."""

_unused: dict[tuple[int, TraxCommand], TraxTracker] = {}
"""Processes started to read `hello`, by process id (of this process) and command."""


def load_plugin(command: TraxCommand, **attributes: Any) -> tuple[type[TraxPlugin], str, str]:
    """Return a plugin that runs a command, and the name and identifier that its tracker sends.

    The process started for this serves the first tracker. `attributes` are those of the plugin.

    Raises `ExternalTrackerError` if the command does not start a tracker that speaks TraX.
    """
    if command not in _greetings:
        tracker = _unused[os.getpid(), command] = TraxTracker(command)
        _greetings[command] = tracker.hello
    hello = _greetings[command]
    summary = hello.get("trax.description") or f"Run {shlex.join(command.command)}."
    plugin = type(
        "TraxPlugin", (TraxPlugin,), attributes | {"__doc__": summary, "command": command}
    )
    return plugin, hello.get("trax.name", ""), hello.get("trax.identifier", "")


def close_unused_processes() -> None:
    """End the processes that were started to read `hello`."""
    while _unused:
        _unused.popitem()[1].close()
