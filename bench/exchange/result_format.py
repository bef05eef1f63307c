"""Interface of result formats: the paths and texts of a tracker's result files.

`FORMATS` in `bench/exchange` lists the formats. A format keeps the pixel and frame numbers of the
files; `importing` and `exporting` convert them.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from glob import escape
from math import nan
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.store.database import ResultsError
from trackmark.bench.store.truth import StoredTruth
from trackmark.datasets import SequenceError, number_files
from trackmark.datasets.decoding import quote
from trackmark.datasets.number_files import form_problem
from trackmark.datasets.truth_file import read_text


class ExchangeError(ResultsError):
    """Failure to read or write result files; the message names file and line."""


@dataclass(frozen=True)
class ResultSequence(StoredTruth):
    """Ground truth of a sequence with imported results, and the paths from which it is opened."""

    source: str = ""
    truth: str = ""  # path of a given ground-truth file; empty if there is none


@dataclass(frozen=True)
class Header:
    """Header of a segment in a file: the frames and the sequence of its rows."""

    location: str  # file and record, for messages
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
    n_unscored: int = 0  # number of last rows that are missing and not scored
    headers: tuple[Header, ...] = ()  # one per segment, in the order of the rows
    protocol: str = ""  # protocol of a file with segments, such as `sre`; empty for one-pass


SegmentRows: TypeAlias = Sequence[tuple[NDArray[Any], ResultRows]]
"""Frames and estimates of each segment of a run."""

BOX, POLYGON = 4, 8
"""Numbers in a row with a box, and with a polygon of four corners."""

Rounding: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Function that rounds boxes, shape (n, 4), to the precision of a file."""


class ResultFormat(ABC):
    """Format of a tracker's result files, which keeps the pixel and frame numbers of the files."""

    expects: str  # content of a tracker's folder, for messages
    exports: str  # boxes, confidences and times that an export contains, for messages
    row: str = "line"  # name of a row in messages
    has_repetitions: bool = False  # True if a folder can contain several repetitions
    # What the toolkits do if the last row is missing. If this is stated, they cut additional rows.
    missing_row: Literal["not scored", "a miss"] | None = None
    segment_protocols: str = ""  # protocols with segments that the format can store, for messages

    @abstractmethod
    def files(self, folder: Path) -> Mapping[str, Sequence[Path]]:
        """Return the files in a tracker's folder by sequence, one per repetition."""

    @abstractmethod
    def recognises(self, file: Path) -> bool:
        """Return whether a file of `files` has this format and no other one."""

    @abstractmethod
    def read(self, file: Path) -> ResultRows:
        """Read the run of a file; raise `ExchangeError`, which names the line, if it is damaged."""

    @abstractmethod
    def write(
        self, folder: Path, sequence: str, repetition: int, rows: ResultRows
    ) -> Mapping[Path, str]:
        """Return the texts of a run by path in the folder of a tracker."""

    @abstractmethod
    def round_boxes(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Round boxes, shape (n, 4), to the precision of a file."""

    def run_files(self, file: Path) -> Sequence[Path]:
        """Return all files with estimates of the run to which a file of `files` belongs."""
        return [file]

    def segments(self, headers: Sequence[Header], sequence: ResultSequence) -> list[NDArray[Any]]:
        """Return the frames of the rows of each header, counted from 0.

        Raises `ExchangeError` for a header that contradicts the sequence.
        """
        raise NotImplementedError

    def can_write_segments(self, protocol: str) -> bool:
        """Return whether the format can store runs by a protocol with segments."""
        return False

    def write_segments(
        self, folder: Path, sequence: str, protocol: str, segments: SegmentRows
    ) -> Mapping[Path, str]:
        """Return the texts of a run with segments; see `can_write_segments`."""
        raise NotImplementedError


def read_text_file(file: Path) -> str:
    """Return the text of a file; raise `ExchangeError` if it cannot be read."""
    try:
        return read_text(file)
    except SequenceError as error:
        raise ExchangeError(str(error)) from error


def first_line(file: Path) -> str:
    """Return the first line of a file; empty if there is none."""
    return read_text_file(file).partition("\n")[0].strip()


def parse_numbers(line: str, location: str, counts: Collection[int] = ()) -> list[float]:
    """Parse numbers between commas, or between tabs and spaces; raise `ExchangeError` otherwise.

    A line can have any of `counts` numbers, by default any number of them. The message starts with
    `location`, the file and the line.
    """
    line = line.strip()
    try:
        values = [float(word) for word in re.split(r"\s*,\s*" if "," in line else r"\s+", line)]
    except ValueError:
        values = []
    problem = form_problem(line)
    # `float` accepts "1_0" as ten.
    if not values or problem or "_" in line or (counts and len(values) not in counts):
        expected = {1: "a number", BOX: "four numbers, x y width height"}
        remedy = " with points as decimal separators" * bool(problem)
        problem = problem and f" {problem}"
        raise ExchangeError(
            f"{location}: {quote(line)}{problem}. Expected: "
            f"{expected.get(min(counts, default=0), 'numbers')}{remedy}."
        )
    return values


def check_decimals(file: Path) -> None:
    """Raise `ExchangeError` for polygons that are boxes with decimal commas."""
    try:
        number_files.check_decimals(read_text_file(file).splitlines(), file)
    except SequenceError as error:
        raise ExchangeError(str(error)) from error


def read_boxes(file: Path) -> ResultRows:
    """Read a text file with four numbers per line, or with eight: the corners of a polygon.

    A polygon is replaced by its bounding box.
    """
    lines = read_text_file(file).rstrip().splitlines()
    counts: Collection[int] = (BOX, POLYGON)
    rows: list[list[float]] = []
    for n, line in enumerate(lines, 1):
        rows.append(parse_numbers(line, f"{file}, line {n}", counts))
        counts = (len(rows[0]),)
    values = np.array(rows, np.float64)
    if values.size == 0 or values.shape[1] == BOX:
        return ResultRows(values.reshape(-1, BOX))
    check_decimals(file)
    points = values.reshape(-1, POLYGON // 2, 2)
    boxes = np.column_stack([points.min(axis=1), np.ptp(points, axis=1)])
    note = "the rows have eight numbers and are read as the bounding boxes of polygons"
    return ResultRows(boxes, simplification=note)


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
        parse_numbers(line, f"{file}, line {n}", (1,))[0] if line.strip() else np.nan
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


def numbered_files(folder: Path, suffix: str = ".txt", n_digits: int = 3) -> dict[str, list[Path]]:
    """Return the files `SEQ/SEQ_001.txt` of each sequence in a folder."""
    files = {
        path.name: sorted(path.glob(f"{escape(path.name)}_{'[0-9]' * n_digits}{suffix}"))
        for path in sorted(folder.iterdir())
        if path.is_dir()
    }
    return {name: paths for name, paths in files.items() if paths}


def abbreviated_list(names: Sequence[str]) -> str:
    """Return the first three names and the number of the others, for a message."""
    first = ", ".join(names[:3]) or "none"
    return f"{first} and {len(names) - 3} more" if len(names) > 3 else first
