"""Text files of numbers, as benchmarks write their truth; a mistake is told with file and line."""

import re
from collections.abc import Collection, Mapping
from collections.abc import Sequence as SequenceOf
from math import isinf, nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import quote
from trackmark.datasets.interface import SequenceError
from trackmark.datasets.truth_file import read_text

# What `float` takes besides (1_0, infinity, digits of other scripts) is a mistake in such a file.
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan)", re.ASCII | re.IGNORECASE)
_BETWEEN = re.compile(r"\s*,\s*|\s+")
_FIELD = re.compile(r"([^=:\[#;]+?)\s*[=:]\s*(.*)")

_MOST_FPS = 100_000.0


def words(line: str) -> list[str]:
    """What stands between a line's commas, tabs or spaces; empty between two commas."""
    return _BETWEEN.split(line.strip()) if line.strip() else []


def numbers(line: str) -> list[float]:
    """Numbers of a line, see `words`; none where anything else is in it, or one is missing."""
    found = words(line)
    if not all(map(_NUMBER.fullmatch, found)):
        return []
    values = [float(word) for word in found]
    return [] if any(map(isinf, values)) else values


def read_rows(
    path: Path, counts: Collection[int], expected: str, what: str = "a box"
) -> NDArray[np.float64]:
    """Read rows of numbers, separated by commas, tabs or spaces; all rows have equally many.

    `counts`: How many numbers a row may have. `expected, what`: What a row holds, for messages.
    The result has shape (n, k), a row a line, at least one; NaN where the file says so. Raises
    `SequenceError` naming file and line.
    """
    rows: list[list[float]] = []
    for number, line in enumerate(read_text(path).rstrip().splitlines(), 1):
        check_line(line, number, path)
        row = numbers(line)
        if len(row) not in ({len(rows[0])} if rows else counts):
            raise SequenceError(
                f"{path}: line {number}: {quote(line.strip())} is not {what}; expected are "
                f"{expected}."
            )
        rows.append(row)
    if not rows:
        raise SequenceError(f"{path}: there are no rows.")
    return np.array(rows)


def check_line(line: str, number: int, path: Path) -> None:
    """Refuse an empty line between rows; `number` counts from 1.

    Raises `SequenceError` naming file and line.
    """
    if not line.strip():
        raise SequenceError(
            f"{path}: line {number} is empty. Expected is one row per frame. Add the row of this "
            "frame, or remove the line if no row is missing."
        )


def check_row_count(rows: int, images: SequenceOf[Path], path: Path) -> None:
    """Refuse a file that has fewer rows than there are images: the missing row may be inside.

    Raises `SequenceError` naming file and counts.
    """
    if rows < len(images):
        raise SequenceError(
            f"{path}: {rows} rows for {len(images)} images: a missing row would shift the ground "
            "truth of all later frames. Expected is one row per image. Add the missing row; if "
            "only the last images have no annotation, add rows nan,nan,nan,nan, or move the images "
            f"after {images[rows - 1].name} to another folder."
        )


def as_boxes(
    rows: NDArray[np.float64], path: Path, origin: float = 0.0, *, minus_is_absent: bool = False
) -> NDArray[np.float64]:
    """Boxes from 0; NaN rows where the target is absent.

    A row without size says that the target is absent, but not in the first row: there it is
    a mistake, which is kept for `Sequence.check_runnable` to refuse.

    `rows`: x, y, width and height as they stand in the file, a row a line; shape (n, 4). `path`: Of
    the file, for messages. `origin`: Coordinate of the first pixel there. `minus_is_absent`:
    Whether a negative size says that the target is absent, too. Raises `SequenceError` naming the
    line of a box of negative size.
    """
    boxes = rows - [origin, origin, 0.0, 0.0]
    negative = np.asarray((boxes[:, 2:] < 0.0).any(axis=1))
    negative[0] = False
    absent = np.asarray(np.isnan(boxes).any(axis=1))
    absent[1:] |= (boxes[1:, 2:] == 0.0).any(axis=1)
    if minus_is_absent:
        absent |= negative
    wrong = np.flatnonzero(negative & ~absent)
    if len(wrong):
        raise SequenceError(f"{path}: line {wrong[0] + 1}: the box has a negative size.")
    boxes[absent] = nan
    return boxes


def read_boxes(
    path: Path, origin: float = 0.0, *, minus_is_absent: bool = False
) -> NDArray[np.float64]:
    """Boxes of a file of rows x, y, width, height; see `read_rows` and `as_boxes`."""
    rows = read_rows(path, {4}, "four numbers, x y width height")
    return as_boxes(rows, path, origin, minus_is_absent=minus_is_absent)


def without_rest(boxes: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Boxes of n frames where only the first is public, the rest NaN; others as they are."""
    if len(boxes) > 1:
        return boxes
    return np.vstack([boxes, np.full((max(0, n - 1), 4), nan)])


def read_flags(path: Path, n: int, most: int = 1, *, padded: bool = False) -> NDArray[np.int64]:
    """Read a whole number a frame, in lines or separated by commas.

    `path`: Of the file. `n`: Number of frames. `most`: Greatest number; they begin at 0. `padded`:
    Whether there may be fewer, for 0 in the rest, or more, for images without truth. Raises
    `SequenceError` naming the line of what is no such number, or the file where they are too few or
    many.
    """
    values: list[int] = []
    for number, line in enumerate(read_text(path).rstrip().splitlines(), 1):
        if padded:
            check_line(line, number, path)
        for word, value in zip(words(line), numbers(line), strict=False):
            if value not in range(most + 1):
                raise SequenceError(
                    f"{path}: line {number}: {quote(word)} is not a whole number of 0 to {most}."
                )
            values.append(int(value))
        if line.strip() and not numbers(line):
            raise SequenceError(f"{path}: line {number}: {quote(line.strip())} is not a number.")
    if padded:
        values = (values + [0] * n)[:n]
    if len(values) != n:
        raise SequenceError(f"{path}: {len(values)} values for the {n} rows of the truth.")
    return np.array(values, np.int64)


def read_fields(path: Path) -> dict[str, str]:
    """Fields of a file of lines `key=value` or `key: value`; other lines are passed over.

    Raises `SequenceError` for a file that is no text: its fields name files.
    """
    text = read_text(path)
    if "\0" in text:
        raise SequenceError(f"{path}: this is no text. Get the file anew.")
    found = (_FIELD.fullmatch(line.strip()) for line in text.splitlines())
    return {match[1]: match[2] for match in found if match}


def fps_of(fields: dict[str, str], key: str, path: Path) -> float | None:
    """Frames a second that a field tells, with or without `Hz`; None where there is no such field.

    Raises `SequenceError` naming file and field where it is no such number.
    """
    if key not in fields:
        return None
    found = numbers(fields[key].lower().removesuffix("hz"))
    if len(found) != 1 or not 0.0 < found[0] <= _MOST_FPS:
        raise SequenceError(f"{path}: {key} is {quote(fields[key])}; expected are frames a second.")
    return found[0]


def place_of(fields: Mapping[str, str], key: str, path: Path, otherwise: str = "") -> Path:
    """File or folder that a field names, or its place where there is no such field.

    `path`: the file of the fields, in whose folder it lies. `otherwise`: a name in that folder.

    Raises `SequenceError` naming file and field where it leads out of that folder.
    """
    named = Path(fields.get(key, otherwise).replace("\\", "/"))
    if named.is_absolute() or ".." in named.parts:
        raise SequenceError(
            f"{path}: {key} is {quote(fields[key])}; expected is what lies in this folder."
        )
    return path.parent / named


def columns(path: Path) -> int:
    """How many numbers stand in the first line; 0 where it holds anything else."""
    with path.open("rb") as file:
        return len(numbers(file.readline(10_000).decode("utf-8-sig", errors="replace")))
