"""Checks of the first box of a result file: the number of the first pixel, and the file's content.

A first box often differs from the ground truth. It is rounded, counts pixels from 1, comes from
another version of the ground truth, or is the tracker's own first estimate. Such a box is accepted.
A file in another unit, such as corners, is refused, because all its boxes would be misread.
Any other misfit causes a message only: the file can still be right.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.result_format import ExchangeError, Rounding
from trackmark.bench.metrics.boxes import overlap
from trackmark.datasets.box_unit import find_other_unit

ORIGINS = (0, 1)
"""Possible numbers of the first pixel."""

# Largest difference of a first box with a known origin [px]. Trackers that scale images miss the
# ground truth by a fraction of a pixel; the two origins differ by 1 px.
_MAX_DIFFERENCE = 0.3
_MIN_OVERLAP = 0.5  # overlap below which a message is shown
_MIN_INIT_OVERLAP = 0.8  # overlap from which a box is that of the initialisation


@dataclass(frozen=True)
class FirstBox:
    """First box of a segment."""

    location: str  # file and record, for messages
    expected: NDArray[np.float64]  # box at initialisation, in pixels from 0
    from_file: NDArray[np.float64]  # in the pixel coordinates of the file; NaN if missing


def find_origin(boxes: Iterable[FirstBox], rounding: Rounding) -> int | None:
    """Return the number of the first pixel, 0 or 1; None if the first boxes do not determine it.

    Only boxes that show position and size of the ground truth count: a tracker that stores its own
    first estimate can miss the position by exactly one pixel.
    """
    return majority(
        origin
        for box in boxes
        if np.isfinite(box.from_file).all()
        for origin in ORIGINS
        if np.abs(rounding(_from_origin(origin, box.expected)) - box.from_file).max()
        < _MAX_DIFFERENCE
    )


def majority(origins: Iterable[int | None]) -> int | None:
    """Return the more frequent of both numbers of the first pixel; None if there is none."""
    counts = Counter(origin for origin in origins if origin is not None).most_common()
    is_tie = len(counts) == len(ORIGINS) and counts[0][1] == counts[1][1]
    return counts[0][0] if counts and not is_tie else None


def shows_init_box(box: FirstBox, rounding: Rounding) -> bool:
    """Return whether a stored box is nearly the box at initialisation."""
    return _fit(box, rounding) >= _MIN_INIT_OVERLAP


def check_first_boxes(
    boxes: Mapping[int, FirstBox],
    rows: NDArray[np.float64],
    rounding: Rounding,
    size: tuple[int, int] | None,
) -> str:
    """Return a message on first boxes that do not fit the ground truth; empty if all fit.

    `boxes` contains the first boxes by their row in `rows`, which are all boxes of the file, shape
    (n, 4). `size` is the width and height of the images, if known. Raises `ExchangeError` if the
    rows are in another unit; see `find_other_unit`.
    """
    first = next(iter(boxes.values()))
    expected = np.full(rows.shape, np.nan)
    for row, box in boxes.items():
        expected[row] = box.expected
    if unit := find_other_unit(rows, size, expected):
        raise ExchangeError(
            f"{first.location}: the boxes look like {unit.name}; the first box is "
            f"{_box_text(first.from_file)}, the ground truth {_box_text(first.expected)}. "
            f"Expected: x, y, width, height in pixels. Convert all boxes: {unit.remedy}."
        )
    misfits = []
    for box in boxes.values():
        if not np.isfinite(box.from_file).all():
            continue
        fit = _fit(box, rounding)
        if fit < _MIN_OVERLAP:
            misfits.append((box, fit))
    if not misfits:
        return ""
    box, fit = misfits[0]
    more = f" {len(misfits)} first boxes of the file do not fit." if misfits[1:] else ""
    return (
        f"{box.location}: the first box {_box_text(box.from_file)} overlaps the ground truth "
        f"{_box_text(box.expected)} by {fit:.2f} only. Expected: the box at initialisation.{more} "
        "Check that the file is for this sequence and target, and holds x, y, width, height in "
        "pixels."
    )


def _from_origin(origin: int, box: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(box + [origin, origin, 0, 0])


def _fit(box: FirstBox, rounding: Rounding) -> float:
    """Return the overlap of a stored box with the expected box, with the better first pixel."""
    return max(
        _overlap(rounding(_from_origin(origin, box.expected)), box.from_file) for origin in ORIGINS
    )


def _overlap(expected: NDArray[np.float64], from_file: NDArray[np.float64]) -> float:
    return float(np.nan_to_num(overlap(expected, from_file))[0])


def _box_text(box: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:g}' for value in box)})"
