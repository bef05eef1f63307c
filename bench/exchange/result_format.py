"""Layout of results: the places and texts of a tracker's files.

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
from trackmark.datasets.decoding import quote
from trackmark.datasets.truth_file import read_text


class ExchangeError(ResultsError):
    """Failure to read or write results in a layout; the message names file and line."""


@dataclass(frozen=True)
class On:
    """Sequence of imported results: its ground truth, and where it was opened from."""

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
    """Estimates of a tracker for n rows, in the numbers of a file."""

    boxes: NDArray[np.float64]  # (n, 4): `[x, y, width, height]` in pixels; NaN rows if missing
    confidence: NDArray[np.float64] | None = None  # (n,): NaN if missing
    states: NDArray[Any] | None = None  # (n,): `bench.metrics.preset.State`, of supervised runs
    # (n,): time of each update, or of the initialisation; NaN if unknown. Times are written and
    # never read: those of imported results come from other machines.
    seconds: NDArray[np.float64] | None = None
    remark: str = ""  # how the file was simplified: a part of a sentence
    headers: tuple[Header, ...] = ()  # one per segment, in the order of the rows
    protocol: str = ""  # name of the protocol with segments that the file states


Held: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Rounds boxes, float64 of shape (n, 4), as the text of a file does."""


SegmentWriter: TypeAlias = Callable[
    [Path, str, Sequence[tuple[NDArray[Any], Said]]], Mapping[Path, str]
]
"""`(folder, sequence, segments) -> files`; a segment is its frames, and its rows in their order."""


def rounded(decimals: int) -> Held:
    """Return a function that rounds boxes to so many decimals."""
    return lambda boxes: np.round(boxes, decimals)


@dataclass(frozen=True)
class Layout:
    """Places and texts of a tracker's files: how they are read, how written."""

    expects: str  # what a tracker's folder holds
    holds: str  # which boxes, confidences and times an export keeps
    origin: int  # number of the first pixel, if a file itself does not show it
    files: Callable[[Path], Mapping[str, Sequence[Path]]]  # by sequence, one per repetition
    # Returns whether a file is of this layout and of no other one; None if the user must name it.
    fits: Callable[[Path], bool] | None
    read: Callable[[Path], Said]  # raises `ExchangeError` that names the line
    # `(folder, sequence, repetition, content) -> texts by path`, in a tracker's folder.
    write: Callable[[Path, str, int, Said], Mapping[Path, str]]
    held: Held = lambda boxes: boxes
    repeats: bool = False  # True if there is room for several repetitions
    row: str = "line"  # what messages call the box of a frame
    parts: Callable[[Path], Sequence[Path]] = lambda file: [file]  # all files of a run
    # Frames of the rows of each header, from 0. Raises `ExchangeError` if a header does not fit.
    frames: Callable[[Sequence[Header], On], list[NDArray[Any]]] | None = None
    # Writer of runs by a protocol with segments, given its text.
    segments: Callable[[str], SegmentWriter | None] = lambda _: None
    holds_segments: str = ""  # protocols for which `segments` returns a writer: a list in words


def text_of(file: Path) -> str:
    """Return the text of a file; raise `ExchangeError` if it cannot be read."""
    try:
        return read_text(file)
    except SequenceError as error:
        raise ExchangeError(str(error)) from error


def first_line(file: Path) -> str:
    """Return the first line of a file; empty if there is none."""
    return text_of(file).partition("\n")[0].strip()


def numbers_of(line: str, place: str, count: int | None = None) -> list[float]:
    """Return numbers between commas, tabs or blanks; raise `ExchangeError` unless `count` of them.

    `place`: file and line, for the message.
    """
    try:
        numbers = [float(text) for text in re.split(r"\s*,\s*|\s+", line.strip())]
    except ValueError:
        numbers = []
    # Python takes 1_0 for ten.
    if not numbers or "_" in line or count not in (None, len(numbers)):
        wanted = {1: "a number", 4: "four numbers, x y width height"}.get(count or 0, "numbers")
        raise ExchangeError(f"{place}: {quote(line.strip())}; expected: {wanted}.")
    return numbers


def boxes_from(file: Path) -> Said:
    """Read a text with four numbers a line."""
    lines = text_of(file).rstrip().splitlines()
    rows = [numbers_of(line, f"{file}, line {n}", 4) for n, line in enumerate(lines, 1)]
    return Said(np.array(rows, np.float64).reshape(-1, 4))


def column_from(file: Path, frames: int) -> NDArray[np.float64] | None:
    """Return the numbers of a text with at most one a line; None if there is no such file."""
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


def column_text(values: NDArray[np.float64]) -> str:
    """Return a text with a number a line, empty if it is NaN."""
    return "".join("\n" if value != value else f"{value!r}\n" for value in values.tolist())


def by_sequence(folder: Path, pattern: str, besides: Sequence[str] = ()) -> dict[str, list[Path]]:
    """Return files by the text for `*` in a pattern, except those whose names end in `besides`."""
    before, after = pattern.split("*")
    found = [path for path in sorted(folder.glob(pattern)) if path.is_file()]
    return {
        path.name.removeprefix(before).removesuffix(after): [path]
        for path in found
        if not path.name.endswith(tuple(besides))
    }


def file_name(sequence: str) -> str:
    """Return a sequence's name as the name of a file."""
    return re.sub(r"[^\w.+=-]", "_", sequence)


def letters(name: str) -> str:
    """Return a name without what toolkits write differently: `Jogging.1`, `jogging-1`."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def some(names: Sequence[str]) -> str:
    """Return the first three of many names for a message, and the number of the others."""
    shown = ", ".join(names[:3]) or "none"
    return f"{shown} and {len(names) - 3} more" if len(names) > 3 else shown
