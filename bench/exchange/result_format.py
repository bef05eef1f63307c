"""What a layout of results is: where a tracker's files lie, how they are read, how written.

A layout is a file in `bench/exchange/formats`, which exports one `Layout`. Its numbers are those of
the files; `importing` and `exporting` shift them.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError
from trackmark.datasets.decoding import brief
from trackmark.datasets.truth_file import read_text


class ExchangeError(ResultsError):
    """Results that can't be read or written in a layout; the message names file and line."""


@dataclass(frozen=True)
class On:
    """A sequence that results are of: its truth, and where it was opened from."""

    name: str
    fingerprint: str
    boxes: NDArray[np.float64]
    source: str
    truth: str = ""


@dataclass(frozen=True)
class Header:
    """Statement of a file about some of its rows: which frames of which sequence they belong to."""

    place: str  # file and part of it, for messages
    rows: int  # number of rows
    start: int | None = None  # first frame as the file counts; None if it does not state it
    end: int | None = None  # last frame
    sequence: str = ""  # name; empty if the file does not state it


@dataclass(frozen=True)
class Said:
    """What a tracker said of a sequence's frames, in a file's own numbers.

    Attributes
    ----------
    boxes : ndarray of float64, shape (n, 4)
        `[x, y, width, height]` in pixels; NaN rows where it gave none.
    confidence : ndarray of float64, shape (n,), or None
        NaN where it gave none.
    states : ndarray of int, shape (n,), or None
        A `bench.metrics.preset.State` a frame, of runs of the supervised protocol.
    seconds : ndarray of float64, shape (n,), or None
        Time of each frame's update, in the frame of initialisation that of it; NaN where unknown.
        They are written, and never read: others' times are of other machines.
    remark : str
        What of the file is not taken as it stands: a part of a sentence.
    headers : tuple of Header
        Statements about the rows, one per segment, in the order of the rows.
    protocol : str
        Name of the protocol with segments that the file states; empty for one pass.
    """

    boxes: NDArray[np.float64]
    confidence: NDArray[np.float64] | None = None
    states: NDArray[Any] | None = None
    seconds: NDArray[np.float64] | None = None
    remark: str = ""
    headers: tuple[Header, ...] = ()
    protocol: str = ""


Held: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""What is kept of boxes, float64 of shape (n, 4)."""


SegmentWriter: TypeAlias = Callable[
    [Path, str, Sequence[tuple[NDArray[Any], Said]]], Mapping[Path, str]
]
"""`(folder, sequence, segments) -> files`; a segment is its frames, and its rows in their order."""


def _one_file(file: Path) -> Sequence[Path]:
    return [file]


def _no_segments(protocol: str) -> SegmentWriter | None:
    return None


def _as_it_is(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    return boxes


def rounded(decimals: int) -> Held:
    """Boxes with so many decimals: what a text of them keeps."""
    return lambda boxes: np.round(boxes, decimals)


@dataclass(frozen=True)
class Layout:
    """Where a tracker's files lie, how they are read, how written.

    Attributes
    ----------
    expects : str
        What a tracker's folder holds.
    holds : str
        What of boxes and times is kept: the exporter's line.
    origin : int
        Number of the first pixel, where a file itself doesn't show it.
    files : callable
        `(folder) -> {sequence: files}`, a file a repetition, in order.
    fits : callable, or None
        `(file) -> bool`: whether one of these is of this layout and no other one; None for a layout
        that is known by its name alone.
    read : callable
        `(file) -> Said`. Raises `ExchangeError` naming the line.
    write : callable
        `(folder, sequence, repetition, said) -> files`, into a tracker's folder.
    held : callable
        What is kept of boxes: rounded to so many digits, say.
    repeats : bool
        Whether it has room for several repetitions.
    row : str
        What a frame's box is called in messages.
    parts : callable
        `(file) -> files`: all files of a run, of which `files` lists the first.
    frames : callable, or None
        `(headers, on) -> frames`: numbers of the frames of each header's rows, from 0. Raises
        `ExchangeError` for a header that does not fit the sequence.
    segments : callable
        `(protocol) -> SegmentWriter or None`, by the text of a protocol with segments.
    holds_segments : str
        The protocols for which `segments` returns a writer: a list in words.
    """

    expects: str
    holds: str
    origin: int
    files: Callable[[Path], Mapping[str, Sequence[Path]]]
    fits: Callable[[Path], bool] | None
    read: Callable[[Path], Said]
    write: Callable[[Path, str, int, Said], Mapping[Path, str]]
    held: Held = _as_it_is
    repeats: bool = False
    row: str = "line"
    parts: Callable[[Path], Sequence[Path]] = _one_file
    frames: Callable[[Sequence[Header], On], list[NDArray[Any]]] | None = None
    segments: Callable[[str], SegmentWriter | None] = _no_segments
    holds_segments: str = ""


def text_of(file: Path) -> str:
    """Text of a file; raises `ExchangeError` where it can't be read."""
    try:
        return read_text(file)
    except SequenceError as error:
        raise ExchangeError(str(error)) from error


def first_line(file: Path) -> str:
    """The first line of a file; empty where there is none."""
    return text_of(file).partition("\n")[0].strip()


def numbers_of(line: str, place: str, count: int | None = None) -> list[float]:
    """Numbers between commas, tabs or blanks; raises `ExchangeError` for another `count` of them.

    `place`: file and line, for the message.
    """
    try:
        numbers = [float(text) for text in re.split(r"\s*,\s*|\s+", line.strip())]
    except ValueError:
        numbers = []
    # Python takes 1_0 for ten.
    if not numbers or "_" in line or count not in (None, len(numbers)):
        wanted = {1: "a number", 4: "four numbers, x y width height"}.get(count or 0, "numbers")
        raise ExchangeError(f"{place}: {brief(line.strip())}; expected: {wanted}.")
    return numbers


def boxes_from(file: Path) -> Said:
    """Boxes of a text with four numbers a line."""
    lines = text_of(file).rstrip().splitlines()
    rows = [numbers_of(line, f"{file}, line {n}", 4) for n, line in enumerate(lines, 1)]
    return Said(np.array(rows, np.float64).reshape(-1, 4))


def column_from(file: Path, frames: int) -> NDArray[np.float64] | None:
    """Numbers of a text with one a line, or none; None where there is no such file."""
    if not file.is_file():
        return None
    lines = text_of(file).removesuffix("\n").split("\n")
    if len(lines) != frames:
        raise ExchangeError(f"{file} has {len(lines)} lines for the {frames} beside it.")
    values = [
        numbers_of(line, f"{file}, line {n}", 1)[0] if line.strip() else np.nan
        for n, line in enumerate(lines, 1)
    ]
    return np.array(values, np.float64)


def by_sequence(folder: Path, pattern: str, besides: Sequence[str] = ()) -> dict[str, list[Path]]:
    """Files by what stands for `*` in a pattern, but for those whose names end in `besides`."""
    before, after = pattern.split("*")
    found = [path for path in sorted(folder.glob(pattern)) if path.is_file()]
    return {
        path.name.removeprefix(before).removesuffix(after): [path]
        for path in found
        if not path.name.endswith(tuple(besides))
    }


def file_name(sequence: str) -> str:
    """A sequence's name as that of a file."""
    return re.sub(r"[^\w.+=-]", "_", sequence)


def letters(name: str) -> str:
    """Return a name without what toolkits write differently: `Jogging.1`, `jogging-1`."""
    return re.sub(r"[^a-z0-9]", "", name.lower())
