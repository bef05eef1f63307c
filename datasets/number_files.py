"""Text files of numbers, which benchmarks use for ground truth; errors name file and line."""

import re
from collections import abc
from collections.abc import Collection, Iterable
from math import isinf, nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import quote
from trackmark.datasets.interface import Array, SequenceError
from trackmark.datasets.truth_file import read_text

# `float` also accepts 1_0, infinity and digits of other scripts, which are invalid here.
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan)", re.ASCII | re.IGNORECASE)
_SEPARATOR = re.compile(r"\s*,\s*|\s+")
_PADDED = re.compile(r"0[0-9]+")
_FIELD = re.compile(r"([^=:\[#;]+?)\s*[=:]\s*(.*)")

POLYGON = 8  # numbers of a polygon of four corners
_MAX_FPS = 100_000.0
_MAX_NEGATIVE = 0.5  # maximum share of rows with a negative size in a file of boxes


def split_line(line: str) -> list[str]:
    """Split a line at commas, tabs or spaces; a word between two commas may be empty."""
    return _SEPARATOR.split(line.strip()) if line.strip() else []


def read_lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines of a file with their numbers from 1, without empty lines at the end.

    Raises `SequenceError` naming the file if there are no lines.
    """
    lines = [*enumerate(read_text(path).rstrip().splitlines(), 1)]
    if not lines:
        raise SequenceError(f"{path}: there are no rows. Expected: one row per frame.")
    return lines


def check_line(line: str, line_number: int, path: Path) -> None:
    """Check that a line is not empty, and has one separator and no decimal commas.

    `line_number` counts from 1. Raises `SequenceError` naming file and line.
    """
    if not line.strip():
        raise SequenceError(
            f"{path}: line {line_number} is empty. Expected: one row per frame. Add the row of "
            "this frame, or remove the line if no row is missing."
        )
    if problem := form_problem(line):
        raise SequenceError(
            f"{path}: line {line_number}: {quote(line.strip())} {problem}. Expected: one separator "
            "between all numbers, and decimal points. Write 12.5 instead of 12,5."
        )


def form_problem(line: str) -> str:
    """Return what shows that a line mixes separators or has decimal commas; otherwise empty.

    Decimal commas turn a box of four numbers into a polygon of eight. They show as commas together
    with other separators, or as second halves such as 05 that no integer has.
    """
    has_spaces = len(line.split(maxsplit=1)) > 1
    if "," not in line or not (has_spaces or (",0" in line and "." not in line)):
        return (
            ""  # most lines; the rest of this function takes as long as the conversion to numbers
        )
    separators = {
        "a comma and a space" if match.strip() and match != match.strip() else match.strip()
        for match in _SEPARATOR.findall(line.strip())
    }
    halves = split_line(line)[1::2] if "." not in line else []
    if len(separators) > 1:
        names = sorted(
            {"": "a space or tab", ",": "a comma"}.get(sign, sign) for sign in separators
        )
        return f"mixes separators ({'; '.join(names)})"
    if any(_PADDED.fullmatch(half) for half in halves):
        return "has numbers with leading zeros, as after decimal commas"
    return ""


def check_decimals(lines: Iterable[str], path: Path) -> None:
    """Refuse polygons of four corners that are boxes with decimal commas: 10,5,12,0,20,5,16,0.

    They have no decimal points, and the second half of each number is one digit in all rows. Lines
    with masks, which start with m, do not count.

    Raises `SequenceError` naming file and line.
    """
    numbered = enumerate(map(str.strip, lines), 1)
    rows = {n: split_line(line) for n, line in numbered if "," in line and not line.startswith("m")}
    polygons = {number: row for number, row in rows.items() if len(row) == POLYGON}
    is_short = [len(half) == 1 for row in polygons.values() for half in row[1::2]]
    if all(is_short) and len(polygons) > 1 and "." not in "".join(map("".join, polygons.values())):
        first = min(polygons)
        raise SequenceError(
            f"{path}: line {first}: {quote(','.join(polygons[first]))} looks like a box with "
            "decimal commas: in all rows, every second number has one digit. Expected: decimal "
            "points. Write 12.5 instead of 12,5."
        )


def parse_numbers(line: str) -> list[float]:
    """Return the numbers of a line, or an empty list if a word is missing or not a number."""
    line_words = split_line(line)
    if not all(map(_NUMBER.fullmatch, line_words)):
        return []
    values = [float(word) for word in line_words]
    return [] if any(map(isinf, values)) else values


def read_rows(path: Path, counts: Collection[int], expected: str, row_name: str = "a box") -> Array:
    """Read rows of numbers, separated by commas, tabs or spaces; all rows have equal length.

    `counts` are the valid numbers of values per row. `expected` and `row_name` describe a row in
    messages. Returns an array of shape (n, k) with one row per line, at least one; it may contain
    NaN.

    Raises `SequenceError` naming file and line.
    """
    rows: list[list[float]] = []
    for line_number, line in read_lines(path):
        check_line(line, line_number, path)
        row = parse_numbers(line)
        if len(row) not in ({len(rows[0])} if rows else counts):
            raise SequenceError(
                f"{path}: line {line_number}: {quote(line.strip())} is not {row_name}. Expected: "
                f"{expected}."
            )
        rows.append(row)
    return np.array(rows)


def enclosing_boxes(points: Array) -> Array:
    """Return the smallest upright boxes around points x1, y1, x2, y2, …, one row per frame."""
    points = points.reshape(len(points), -1, 2)
    return np.hstack([points.min(axis=1), np.ptp(points, axis=1)])


def box_of_region(row: list[float]) -> list[float]:
    """Return the box around a box or a polygon; NaN for fewer than four numbers."""
    if len(row) <= 4:
        return row if len(row) == 4 else [nan] * 4
    return [*enclosing_boxes(np.array([row]))[0]]


def check_row_count(n_rows: int, images: abc.Sequence[Path], path: Path) -> None:
    """Check that a file has a row for every image, because a missing row could be an inner row.

    A file with one row is valid: in test sets, only the first box is public.

    Raises `SequenceError` naming file and counts.
    """
    if 1 < n_rows < len(images):
        raise SequenceError(
            f"{path}: {n_rows} rows for {len(images)} images: a missing row would shift the ground "
            "truth of all later frames. Expected: one row per image. Add the missing row; if only "
            f"the last images have no annotation, move the images after {images[n_rows - 1].name} "
            "to another folder."
        )


def frames_with_values(n_rows: int, images: abc.Sequence[Path]) -> int:
    """Return the number of frames with flags or labels, for a number of ground-truth rows.

    If only the first box is public, flags and labels may still exist for all images.
    """
    return len(images) if n_rows == 1 else n_rows


def as_boxes(rows: Array, path: Path, origin: float = 0.0, *, zero_is_absent: bool = True) -> Array:
    """Convert rows of a file to boxes in coordinates from 0; a NaN row means an absent target.

    A box of size 0 means that the target is absent, unless the format has flags for this. Other
    boxes without a positive size are malformed. They are kept: `recorded` counts them, and
    `Sequence.check_runnable` refuses one in the first row.

    `rows`, shape (n, 4), are x, y, width and height. `path` is the file, for messages. `origin` is
    the coordinate of the first pixel in the file.

    Raises `SequenceError` naming a line if more than half of the sizes are negative: then the
    columns have another meaning. Fewer are valid: DepthTrack (xiaozai/DeT#5) and GOT-10k
    (got-10k/toolkit#10) have them in frames without target, which can be many.
    """
    boxes = rows - [origin, origin, 0.0, 0.0]
    negative = np.flatnonzero((boxes[:, 2:] < 0.0).any(axis=1))
    if len(negative) > max(1.0, _MAX_NEGATIVE * len(boxes)):
        raise SequenceError(
            f"{path}: line {negative[0] + 1}: the box has a negative size, as {len(negative)} of "
            f"{len(boxes)} rows. Expected: x, y, width, height in pixels."
        )
    absent = np.asarray(np.isnan(boxes).any(axis=1))
    if zero_is_absent:
        sizes = boxes[:, 2:]
        absent[1:] |= ((sizes == 0.0).any(axis=1) & (sizes >= 0.0).all(axis=1))[1:]
    boxes[absent] = nan
    return boxes


def read_integers(
    path: Path, n: int, maximum: int = 1, *, padded: bool = False
) -> NDArray[np.int64]:
    """Read one integer per frame from 0 to `maximum`, in lines or separated by commas.

    `n` is the number of frames. If `padded`, missing values at the end are 0, and additional values
    belong to images without ground truth.

    Raises `SequenceError` naming the line of an invalid value, or the file if the count is wrong.
    """
    values: list[int] = []
    for line_number, line in enumerate(read_text(path).rstrip().splitlines(), 1):
        if padded or line.strip():
            check_line(line, line_number, path)
        for word, value in zip(split_line(line), parse_numbers(line), strict=False):
            if value not in range(maximum + 1):
                raise SequenceError(
                    f"{path}: line {line_number}: {quote(word)} is not an integer from 0 to "
                    f"{maximum}."
                )
            values.append(int(value))
        if line.strip() and not parse_numbers(line):
            raise SequenceError(
                f"{path}: line {line_number}: {quote(line.strip())} is not a number."
            )
    if padded:
        values = (values + [0] * n)[:n]
    if len(values) != n:
        raise SequenceError(f"{path}: {len(values)} values for {n} rows of ground truth.")
    return np.array(values, np.int64)


def read_flags(
    files: Iterable[Path], n: int, *, padded: bool = False
) -> dict[str, NDArray[np.bool_]]:
    """Read one flag per frame from each existing file; keys are the files' stems."""
    return {
        file.stem: read_integers(file, n, padded=padded) > 0 for file in files if file.is_file()
    }


class Fields(dict[str, str]):
    """Fields of a file with lines `key=value` or `key: value`; other lines are skipped.

    There are none if the file is missing. Raises `SequenceError` for a file with NUL characters:
    fields contain file names.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        fields_text = read_text(path) if path.is_file() else ""
        if "\0" in fields_text:
            raise SequenceError(f"{path}: not a text file. Download the file again.")
        matches = (_FIELD.fullmatch(line.strip()) for line in fields_text.splitlines())
        super().__init__({match[1]: match[2] for match in matches if match})

    def fps(self, key: str) -> float | None:
        """Return the frame rate in a field, such as `30` or `30 Hz`; None if it is missing.

        Raises `SequenceError` naming file and field if its value is not a frame rate.
        """
        if key not in self:
            return None
        values = parse_numbers(self[key].lower().removesuffix("hz"))
        if len(values) != 1 or not 0.0 < values[0] <= _MAX_FPS:
            raise SequenceError(
                f"{self.path}: {key} is {quote(self[key])}. Expected: frames per second."
            )
        return values[0]

    def location(self, key: str, default: str = "") -> Path:
        """Return the file or folder that a field names, or `default`, in the folder of the fields.

        Raises `SequenceError` naming file and field if the value leads out of this folder.
        """
        relative = Path(self.get(key, default).replace("\\", "/"))
        if relative.is_absolute() or ".." in relative.parts:
            raise SequenceError(
                f"{self.path}: {key} is {quote(self[key])}. Expected: a path inside this folder."
            )
        return self.path.parent / relative


def count_columns(path: Path) -> int:
    """Return the number of values in the first line, or 0 if a word is not a number."""
    with path.open("rb") as file:
        return len(parse_numbers(file.readline(10_000).decode("utf-8-sig", errors="replace")))
