"""Client of trackers that speak TraX, the protocol of the VOT challenge, on stdin and stdout.

Versions 1 to 4 of the protocol are supported, with one object and colour images. Specification:
https://trax.readthedocs.io. A tracker that reads images from files gets the name of one
uncompressed file in memory, which is overwritten for each frame.
"""

import base64
import os
import re
import shlex
import shutil
from collections.abc import Collection
from contextlib import suppress
from math import isnan, nan
from pathlib import Path
from time import monotonic
from typing import Any, ClassVar, NamedTuple

import cv2
import numpy as np

from trackmark.bench.external import keep_process, take_process
from trackmark.bench.external.plugin import ExternalOptions, ExternalPlugin, digest_file
from trackmark.bench.external.process import ExternalTrackerError, LineProcess
from trackmark.bench.operating_system import FRAME_FOLDER, FRAME_PREFIX, TemporaryPath
from trackmark.datasets.number_files import form_problem
from trackmark.trackers import Box, Estimate, Image, Mask, TrackerError
from trackmark.trackers.base.call_clock import CallClock, CallTime
from trackmark.trackers.base.estimate_check import read_estimate
from trackmark.trackers.base.plain import create_plugin

MARK = b"@@TRAX:"
"""Start of each message; lines without it are output of the tracker."""

QUIT_SECONDS = 2.0
"""Time that a tracker has to end after the message `quit` [s]."""

_ARGUMENT = re.compile(r'"((?:[^"\\]|\\.)*)"|(\S+)')
_KEY = re.compile(r"[\w.]{1,64}", re.ASCII)
_MAX_MASK_PIXELS = 1 << 26


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
    body = line.partition(MARK)[2].decode(errors="replace").strip()
    name, _, rest = body.partition(" ")
    message = Message(name, [], {})
    for quoted, bare in _ARGUMENT.findall(rest):
        unescaped = re.sub(r"\\(.)", lambda match: match[1].replace("n", "\n"), quoted)
        argument = unescaped if quoted else bare
        key, equals, value = argument.partition("=")
        if equals and _KEY.fullmatch(key):
            message.properties[key] = value
        else:
            message.values.append(argument)
    return message


def format_message(name: str, /, *values: str, **properties: object) -> bytes:
    r"""Return the line of a message.

    >>> format_message("frame", "file:///tmp/1.bmp")
    b'@@TRAX:frame "file:///tmp/1.bmp"\n'
    """
    arguments = [*values, *(f"{key}={value}" for key, value in properties.items())]
    escaped = (re.sub(r'(["\\])', r"\\\1", text).replace("\n", "\\n") for text in arguments)
    return MARK + " ".join([name, *(f'"{text}"' for text in escaped)]).encode() + b"\n"


def split_formats(joined: str) -> list[str]:
    """Return the items of a list such as `path;memory;`."""
    return [item for item in re.split("[;,]", joined) if item]


def parse_region(region: str, shape: tuple[int, ...]) -> tuple[Box | None, Mask | None]:
    """Return the box and the mask of a region.

    A polygon gives its bounding box; only a mask gives a mask, cropped to the image. The box is
    None for an empty mask and for a special region, a single number such as "0": no target.

    `shape`: (height, width) of the image.

    Raises `ValueError` for a malformed region, for decimal commas, which a program writes under
    the locale of some countries, and for numbers that are not finite.
    """
    if region.startswith("mask:"):
        return _parse_mask(region.removeprefix("mask:"), shape)
    if form_problem(region):
        raise ValueError(region)
    values = np.array([float(value) for value in split_formats(region)])
    if len(values) in (0, 2) or not np.isfinite(values).all():
        raise ValueError(region)
    if len(values) == 4:
        return values, None
    if len(values) == 1:
        return None, None
    points = values.reshape(-1, 2)
    return np.concatenate([points.min(axis=0), np.ptp(points, axis=0)]), None


def _parse_mask(mask_text: str, shape: tuple[int, ...]) -> tuple[Box | None, Mask]:
    """Return box and mask of `x,y,width,height` and lengths of runs of 0 and 1 in turn, by row."""
    x, y, width, height, *runs = (int(number) for number in split_formats(mask_text))
    size = width * height
    if min(width, height, *runs, 0) < 0 or not sum(runs) <= size <= _MAX_MASK_PIXELS:
        raise ValueError(mask_text)
    pixels = np.flatnonzero(np.repeat(np.arange(len(runs)) % 2, runs))
    rows, columns = np.unravel_index(pixels, (height, width))
    rows, columns = rows + y, columns + x
    inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    mask = np.zeros(shape[:2], np.bool_)
    mask[rows[inside], columns[inside]] = True
    box = np.array(cv2.boundingRect(mask.view(np.uint8)), np.float64)
    return box if mask.any() else None, mask


def format_region(formats: Collection[str], box: Box, mask: Mask | None = None) -> str:
    """Return a region in one of the formats that a tracker reads.

    A mask is used if the tracker reads masks and `mask` is not None; otherwise, the box becomes a
    rectangle, a polygon or, if the tracker reads nothing else, a mask. Numbers are exact.
    """
    values = x, y, width, height = [float(value) for value in box]
    if "mask" in formats and (mask is not None or not {"rectangle", "polygon"} & set(formats)):
        left, top = (round(x), round(y)) if mask is None else (0, 0)
        if mask is None:
            mask = np.ones((max(1, round(height)), max(1, round(width))), np.bool_)
        edges = np.flatnonzero(np.diff(mask.ravel(), prepend=False))  # the first run has zeros
        runs = np.diff(edges, prepend=0, append=mask.size)
        return "mask:" + ",".join(map(str, [left, top, *mask.shape[::-1], *runs]))
    if "polygon" in formats and "rectangle" not in formats:
        values = [x, y, x + width, y, x + width, y + height, x, y + height]
    return ",".join(map(repr, values))


class TraxOptions(ExternalOptions):
    """Table with the key `trax`."""

    trax: str
    folder: str = ""
    confidence: bool = True  # name: documented option
    stochastic: bool = False


class TraxProcess(LineProcess):
    """Process of a tracker that speaks TraX.

    `hello` holds the properties that the tracker sent at its start, such as `trax.name`.

    Raises `ExternalTrackerError`, here and in all methods, if the process ends, exceeds a time
    limit, or sends an invalid message.
    """

    def __init__(self, options: TraxOptions) -> None:
        file = TemporaryPath(FRAME_FOLDER, FRAME_PREFIX, ".bmp", is_file=True)
        self.file = str(file.path)
        super().__init__(
            shlex.split(options.trax),
            MARK,
            environment={"TRAX": "1", **options.environment},  # as vot-toolkit
            folder=Path(options.folder),
            files=[file],
        )
        self.hello = self.receive("hello", options.start_limit).properties
        self.version = self.hello.get("trax.version", "1")
        if self.version not in ("1", "2", "3", "4"):
            raise self.fail(f"uses version {self.version!r} of TraX. Expected: 1 to 4")
        self.regions = self._formats("trax.region", "rectangle")
        self._images = self._formats("trax.image", "path")
        if not {"path", "memory", "data", "buffer"} & set(self._images):
            raise self.fail(f"reads images by {self._images}. Expected: path, memory or buffer")
        channels = self._formats("trax.channels", "color")
        if channels != ["color"]:
            raise self.fail(f"reads the image channels {channels}. Expected: color")

    def _formats(self, key: str, default: str) -> list[str]:
        return split_formats(self.hello.get(key, "")) or [default]

    def fail(self, problem: str) -> ExternalTrackerError:
        """See `LineProcess.fail`."""
        hint = "" if hasattr(self, "hello") else " (no TraX hello)"
        return super().fail(problem + hint)

    def receive(self, name: str, seconds: float) -> Message:
        """Return the tracker's next message, whose expected name is given."""
        line = self.read_line(seconds)
        message = parse_message(line)
        if message.name == "quit":
            reason = message.properties.get("trax.reason") or "no reason given"
            raise self.fail(f"ended the session: {reason}")
        if message.name != name and not (name == "state" and _is_answer(line)):
            received = line.decode(errors="replace")[:80]
            raise self.fail(f"sent {received!r}. Expected: the message {name!r}")
        return message

    def show(self, image: Image) -> str:
        """Return the argument of a message that passes an image to the tracker."""
        if "path" in self._images:
            if not cv2.imwrite(self.file, image):
                raise OSError(f"{self.file}: the image cannot be written. Is the disk full?")
            return f"file://{self.file}"
        if "memory" in self._images:
            encoded = base64.b64encode(image[:, :, ::-1].tobytes()).decode()  # RGB
            return f"image:{image.shape[1]};{image.shape[0]};rgb;{encoded}"
        _, png = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        return f"data:image/png;{base64.b64encode(png.tobytes()).decode()}"

    def close(self, seconds: float = QUIT_SECONDS) -> None:
        """End the process, after up to `seconds` to end by itself.

        Raises `ExternalTrackerError` if the process has sent more answers than requested.
        """
        line, limit = b"", monotonic() + seconds
        with suppress(ExternalTrackerError):  # it ends, or takes too long
            self.send(format_message("quit"), seconds)
            self._stdin.close()
            while not _is_answer(line) and monotonic() < limit:
                line = self.read_line(seconds)
        if _is_answer(line):
            raise self.fail(_too_many(line))
        super().close()


class TraxPlugin(ExternalPlugin):
    """Plugin of a tracker that speaks TraX; see `open_trax_plugin`.

    The parameters are properties of the message `initialize`; most trackers ignore them.
    """

    external_options: ClassVar[TraxOptions]
    clock = "wall time minus run delay, with reading of images"

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        self.process: TraxProcess = take_process(
            lambda: TraxProcess(self.external_options), self.external_options, self.digest
        )
        self._clock = CallClock()

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        region, address = format_region(self.process.regions, box, mask), self.process.show(image)
        properties = self.parameters.model_dump()
        if self.process.version == "4":
            request = format_message("initialize", region, **properties)
            request += format_message("frame", address)
        else:
            request = format_message("initialize", address, region, **properties)
        self._last_box = np.array(box)
        self._ask(request, image, self.external_options.start_limit)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`.

        If the tracker reports no target (see `parse_region` and `NO_TARGET`), the estimate has the
        last box and is not visible.
        """
        request = format_message("frame", self.process.show(image))
        box, mask, confidence_text = self._ask(request, image, self.external_options.frame_limit)
        has_confidence = self.external_options.confidence
        confidence = self._parse_confidence(confidence_text) if has_confidence else nan
        fields = {"box": box, "visible": box is not None, "confidence": confidence, "mask": mask}
        return self.estimate(read_estimate(fields, image.shape))

    def _parse_confidence(self, printed: str) -> float:
        with suppress(ValueError):
            confidence = float(printed)
            if 0.0 <= confidence <= 1.0 or isnan(confidence):
                return confidence
        raise self.process.fail(
            f"answered with the confidence {printed}. Expected: a number from 0 to 1. Add "
            "confidence=false to the specification to ignore confidences"
        )

    def close(self) -> None:
        """See `ExternalPlugin.close`."""
        self.process.close()

    def _ask(self, request: bytes, image: Image, seconds: float) -> tuple[Any, Any, str]:
        """Send a request; return box, mask and text of the confidence of the answer."""
        if line := self.process.unread_line():
            raise self.process.fail(_too_many(line))
        # The tracker begins at the end of the line. The time does not contain the transfer.
        self.process.send(request[:-1], seconds)
        self.process.wait_until_ready()
        started = self.process.counters()
        self._clock.start()
        self.process.send(request[-1:], seconds)
        message = self.process.receive("state", seconds)
        call = self._clock.stop()
        stopped = self.process.counters()
        delay = min(stopped.run_delay - started.run_delay, call.seconds)
        self.call_time = CallTime(
            call.seconds - delay, call.run_delay + delay, stopped.cpu - started.cpu, 0.0
        )
        if len(message.values) > 1:
            raise self.process.fail(
                f"answered with {len(message.values)} regions, {' '.join(message.values)[:80]!r}. "
                "Expected: one region without spaces"
            )
        region = "".join(message.values)
        try:
            box, mask = parse_region(region, image.shape)
        except ValueError:
            raise self.process.fail(
                f"answered with the region {region[:80]!r}. Expected: finite numbers with decimal "
                "points, as a rectangle, a polygon or a mask"
            ) from None
        return box, mask, message.properties.get("confidence", "nan")


def _is_answer(line: bytes) -> bool:
    """Return whether a line has the message `state`, which some versions call `status`."""
    return parse_message(line).name in ("state", "status")


def _too_many(line: bytes) -> str:
    """Return the problem of a message that answers no request."""
    text = line.decode(errors="replace")[:80]
    return f"sent {text!r} without a request. Expected: one answer per frame"


def open_trax_plugin(
    options: TraxOptions, owner: str, folder: Path
) -> tuple[type[TraxPlugin], Path]:
    """Return a plugin that runs a command, and the first file that the command names.

    Relative paths of the options refer to `folder`; `owner` is the tracker in messages. The
    process started for this serves the first tracker.
    """
    folder = (folder / Path(options.folder).expanduser()).absolute()
    options = options.model_copy(update={"folder": str(folder)})
    try:
        command = shlex.split(options.trax)
    except ValueError as error:
        raise TrackerError(f"{owner}: command {options.trax!r}: {error}.") from None
    if not any(command):
        raise TrackerError(
            f"{owner}: the command {options.trax!r} names no program. Give a program with its "
            "arguments."
        )
    files = _command_files(command, options)
    digest = "-".join(map(digest_file, files))
    process = take_process(lambda: TraxProcess(options), options, digest)
    keep_process(process, options, digest)
    hello = process.hello
    description = {
        "class": "TraxPlugin",
        "doc": hello.get("trax.description") or f"Run {options.trax}.",
        "name": "",
        "parameters": options.parameters,
        "randomness": "generator" if options.stochastic else "none",
    }
    version = {
        "source": options.version or digest,
        "command": options.trax,
        "name": hello.get("trax.name", ""),
        "identifier": hello.get("trax.identifier", ""),
        "libraries": {},
    }
    attributes = {"external_options": options, "digest": digest, "version": version}
    plugin = create_plugin(TraxPlugin, owner, description, **attributes)
    return plugin, files[0] if files else folder


def _command_files(command: list[str], options: TraxOptions) -> list[Path]:
    """Return the files that a command names by path, or else its program's file in PATH."""
    folder = Path(options.folder)
    files = [folder / Path(text).expanduser() for text in command]
    if "-m" in command[:-1]:  # a module of Python, as in vot-toolkit's `traxpython`
        module = command[command.index("-m") + 1].replace(".", "/")
        paths = options.environment.get("PYTHONPATH", "").split(os.pathsep)
        files += [folder / path / f"{module}.py" for path in paths]
    program = shutil.which(command[0])
    existing = [file for file in files if os.path.isfile(file)]  # noqa: PTH113  # `Path.is_file` raises OSError for long arguments
    return existing or ([Path(program)] if program else [])
