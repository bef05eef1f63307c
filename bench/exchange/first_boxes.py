"""Checks of the first box of a result file: the number of the first pixel, and the file's content.

A first box often differs from the ground truth. It is rounded, counts pixels from 1, comes from
another version of the ground truth, or is the tracker's own first estimate. Such a box is accepted.
A box that fits better as two corners is refused, because all boxes of the file would be misread.
Any other misfit causes a message only: the file can still be right.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.result_format import ExchangeError, Rounding
from trackmark.bench.metrics.overlap import overlap

_ORIGINS = (0, 1)
# Largest difference of a first box with a known origin [px]. Trackers that scale images miss the
# ground truth by a fraction of a pixel; the two origins differ by 1 px.
_MAX_DIFFERENCE = 0.3
_MIN_OVERLAP = 0.5  # overlap below which a message is shown
_CERTAIN_OVERLAP = 0.9  # overlap above which a box is never taken for corners
_MIN_CORNER_OVERLAP = 0.8  # overlap as corners below which a box is not taken for corners
_MIN_ORDERED = 0.9  # minimum share of rows whose second corner is right of and below the first
_MIN_GAIN = 4  # minimum ratio of 1 - overlap as a box to 1 - overlap as corners


@dataclass(frozen=True)
class FirstBox:
    """First box of a segment."""

    place: str  # file and record, for messages
    expected: NDArray[np.float64]  # box at initialisation, in pixels from 0
    stored: NDArray[np.float64]  # in the pixel coordinates of the file; NaN if missing


def find_origin(boxes: Iterable[FirstBox], rounding: Rounding) -> int | None:
    """Return the number of the first pixel, 0 or 1; None if the first boxes do not determine it."""
    matching = [
        {
            origin
            for origin in _ORIGINS
            if np.abs(rounding(_from_origin(origin, box.expected)) - box.stored)[:2].max()
            < _MAX_DIFFERENCE
        }
        for box in boxes
        if np.isfinite(box.stored).all()
    ]
    common = set.intersection(*matching) if matching else set()
    return min(common) if common else None


def check_first_boxes(
    boxes: Sequence[FirstBox], rows: NDArray[np.float64], rounding: Rounding
) -> str:
    """Return a message on first boxes that do not fit the ground truth; empty if all fit.

    `rows`: all boxes of the file, shape (n, 4). Raises `ExchangeError` if a first box fits much
    better as corners `x1, y1, x2, y2`.
    """
    finite = rows[np.isfinite(rows).all(axis=1)]
    in_order = (finite[:, 2:] >= finite[:, :2]).all(axis=1)  # also for boxes without size
    can_be_corners = bool(in_order.sum() >= _MIN_ORDERED * len(finite))
    misfits = []
    for box in boxes:
        if not np.isfinite(box.stored).all():
            continue
        fit = max(
            _overlap(rounding(_from_origin(origin, box.expected)), box.stored)
            for origin in _ORIGINS
        )
        as_corners = _corner_overlap(box)
        fits_as_corners = (
            as_corners >= _MIN_CORNER_OVERLAP and 1 - as_corners < (1 - fit) / _MIN_GAIN
        )
        if can_be_corners and fit < _CERTAIN_OVERLAP and fits_as_corners:
            raise ExchangeError(
                f"{box.place}: the first box {_text(box.stored)} fits the ground truth "
                f"{_text(box.expected)} as corners x1, y1, x2, y2 (overlap {as_corners:.2f}; "
                f"{fit:.2f} as a box). Expected: x, y, width, height. Convert all boxes: "
                "subtract x1 from x2 and y1 from y2."
            )
        if fit < _MIN_OVERLAP:
            misfits.append((box, fit))
    if not misfits:
        return ""
    box, fit = misfits[0]
    more = f" {len(misfits)} first boxes of the file do not fit." if misfits[1:] else ""
    return (
        f"{box.place}: the first box {_text(box.stored)} overlaps the ground truth "
        f"{_text(box.expected)} by {fit:.2f} only. Expected: the box at initialisation.{more} "
        "Check that the file is for this sequence and target, and holds x, y, width, height in "
        "pixels."
    )


def _from_origin(origin: int, box: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(box + [origin, origin, 0, 0])


def _corner_overlap(box: FirstBox) -> float:
    """Return the best overlap of a box read as corners, including or excluding the last pixel."""
    x1, y1, x2, y2 = box.stored.tolist()
    return max(
        _overlap(
            _from_origin(origin, box.expected),
            np.array([x1, y1, x2 - x1 + inclusive, y2 - y1 + inclusive]),
        )
        for origin, inclusive in product(_ORIGINS, (0, 1))
    )


def _overlap(expected: NDArray[np.float64], stored: NDArray[np.float64]) -> float:
    return float(np.nan_to_num(overlap(expected, stored))[0])


def _text(box: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:g}' for value in box)})"
