"""Interface of result formats: the paths and texts of a tracker's result files.

Each module in `bench/exchange/formats` defines one `ResultFormat`. A format keeps the pixel and
frame numbers of the files; `importing` and `exporting` convert them.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError
from trackmark.datasets.decoding import quote
from trackmark.datasets.truth_file import read_text


class ExchangeError(ResultsError):
    """Failure to read or write result files; the message names file and line."""


@dataclass(frozen=True)
class ResultSequence:
    """Sequence of imported results, with ground truth and source."""

    name: str
    fingerprint: str
    boxes: NDArray[np.float64]
    source: str
    truth: str = ""
    image_size: tuple[int, int] | None = None  # width and height [pixels]; None if unknown


@dataclass(frozen=True)
class Header:
    """Header of a segment in a file: the frames and the sequence of its rows."""

    place: str  # file and record, for messages
    n_rows: int
    start: int | None = None  # first frame in the numbering of the file; None if not stated
    end: int | None = None  # last frame; None if not stated
    sequence: str = ""  # name; empty if not stated


@dataclass(frozen=True)
class ResultRows:
    """Estimates of a tracker in n rows of a file, with the pixel numbers of the file."""

    boxes: NDArray[np.float64]  # (n, 4): `[x, y, width, height]` in pixels; NaN rows if missing
    confidence: NDArray[np.float64] | None = None  # (n,): NaN if missing
    states: NDArray[Any] | None = None  # (n,): `FrameState` of a supervised run
    # Mean time of an update [s]; NaN if unknown. It is exported but not imported: times of other
    # machines are not comparable.
    update_seconds: float = nan
    simplification: str = ""  # message on regions that were simplified when the file was read
    headers: tuple[Header, ...] = ()  # one per segment, in the order of the rows
    protocol: str = ""  # protocol of a file with segments, such as `sre`; empty for one-pass


Rounding: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Function that rounds boxes, shape (n, 4), to the precision of a file."""


SegmentWriter: TypeAlias = Callable[
    [Path, str, Sequence[tuple[NDArray[Any], ResultRows]]], Mapping[Path, str]
]
"""Function `(folder, sequence, segments) -> texts by path`; a segment is `(frames, rows)`."""


def round_to(decimals: int) -> Rounding:
    """Return a function that rounds boxes to a number of decimals."""
    return lambda boxes: np.round(boxes, decimals)


@dataclass(frozen=True)
class ResultFormat:
    """Functions that find, read and write the result files of a tracker."""

    expects: str  # content of a tracker's folder, for messages
    exports: str  # boxes, confidences and times that an export contains, for messages
    origin: int  # coordinate of the first pixel, unless the first boxes show another one
    files: Callable[[Path], Mapping[str, Sequence[Path]]]  # by sequence; one file per repetition
    # Return whether a file has this format and no other one. None: the user must name the format.
    fits: Callable[[Path], bool] | None
    read: Callable[[Path], ResultRows]  # raises `ExchangeError` that names the line
    # `(folder of the tracker, sequence, repetition, rows) -> texts by path`
    write: Callable[[Path, str, int, ResultRows], Mapping[Path, str]]
    rounding: Rounding = lambda boxes: boxes
    has_repetitions: bool = False  # True if a folder can contain several repetitions
    row: str = "line"  # name of a row in messages
    parts: Callable[[Path], Sequence[Path]] = lambda file: [file]  # all files of a run
    # Return the frames of the rows of each header, from 0. Raise `ExchangeError` for a header that
    # contradicts the sequence.
    frames: Callable[[Sequence[Header], ResultSequence], list[NDArray[Any]]] | None = None
    # Return the writer of runs by a protocol with segments, such as "tre"; None if there is none.
    segment_writer: Callable[[str], SegmentWriter | None] = lambda _: None
    segment_protocols: str = ""  # protocols for which there is a segment writer, for messages


def read_text_file(file: Path) -> str:
    """Return the text of a file; raise `ExchangeError` if it cannot be read."""
    try:
        return read_text(file)
    except SequenceError as error:
        raise ExchangeError(str(error)) from error


def first_line(file: Path) -> str:
    """Return the first line of a file; empty if there is none."""
    return read_text_file(file).partition("\n")[0].strip()


def parse_numbers(line: str, place: str, count: int | None = None) -> list[float]:
    """Parse numbers between commas, tabs or spaces; raise `ExchangeError` unless there are `count`.

    `place`: file and line, for the message.
    """
    try:
        numbers = [float(text) for text in re.split(r"\s*,\s*|\s+", line.strip())]
    except ValueError:
        numbers = []
    # `float` accepts "1_0" as ten.
    if not numbers or "_" in line or count not in (None, len(numbers)):
        expected = {1: "a number", 4: "four numbers, x y width height"}.get(count or 0, "numbers")
        raise ExchangeError(f"{place}: {quote(line.strip())}. Expected: {expected}.")
    return numbers


def read_boxes(file: Path) -> ResultRows:
    """Read a text file with four numbers per line."""
    lines = read_text_file(file).rstrip().splitlines()
    rows = [parse_numbers(line, f"{file}, line {n}", 4) for n, line in enumerate(lines, 1)]
    return ResultRows(np.array(rows, np.float64).reshape(-1, 4))


def read_column(file: Path, n_rows: int) -> NDArray[np.float64] | None:
    """Read a text file with at most one number per line; return None if the file is missing."""
    if not file.is_file():
        return None
    lines = read_text_file(file).removesuffix("\n").split("\n")
    if len(lines) != n_rows:
        raise ExchangeError(
            f"{file}: {len(lines)} lines. Expected: {n_rows}, as in the file with the boxes."
        )
    values = [
        parse_numbers(line, f"{file}, line {n}", 1)[0] if line.strip() else np.nan
        for n, line in enumerate(lines, 1)
    ]
    return np.array(values, np.float64)


def column_text(values: NDArray[np.float64]) -> str:
    """Return a text with one number per line and an empty line for NaN."""
    return "".join("\n" if value != value else f"{value!r}\n" for value in values.tolist())


def files_by_sequence(folder: Path, suffix: str, *excluded: str) -> dict[str, list[Path]]:
    """Return the files with a suffix by stem, except those whose names end in `excluded`."""
    return {
        path.stem: [path]
        for path in sorted(folder.glob(f"*{suffix}"))
        if path.is_file() and not path.name.endswith(excluded)
    }


def file_name(sequence: str) -> str:
    """Convert the name of a sequence to a file name."""
    return re.sub(r"[^\w.+=-]", "_", sequence)


def normalized_name(name: str) -> str:
    """Return the lower-case letters and digits of a name: `Jogging.1` equals `jogging-1`."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def abbreviated_list(names: Sequence[str]) -> str:
    """Return the first three names and the number of the others, for a message."""
    first = ", ".join(names[:3]) or "none"
    return f"{first} and {len(names) - 3} more" if len(names) > 3 else first
