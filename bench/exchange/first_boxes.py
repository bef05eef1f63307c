"""First boxes of results against the box at initialisation: where pixels are counted from, and fit.

A first box in a result file is often not exactly the ground truth: it is rounded, counted from 1,
of another version of the ground truth, or the tracker's own first estimate. Such a box passes. A
box that fits as two corners is refused, as all boxes of the file would be misread. Any other box
that does not fit is reported in a message: the file may still be what the user means.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.result_format import ExchangeError, Held
from trackmark.bench.metrics.overlap import overlap

_ORIGINS = (0, 1)
_SAME = 0.3  # pixels: trackers that scale images begin beside the truth; origins are 1 apart
_FITS = 0.5  # overlap of a first box that is taken without a message
_CERTAIN = 0.9  # overlap at which no other reading is considered
_CORNERS = 0.8  # overlap as corners, below which a box is not taken for corners
_ORDERED = 0.9  # share of the rows whose second corner is right of and below the first
_BETTER = 4  # the other reading is this many times closer to an overlap of 1


@dataclass(frozen=True)
class FirstBox:
    """First box of a segment."""

    place: str  # file and record, for messages
    expected: NDArray[np.float64]  # box at initialisation, in pixels from 0
    stored: NDArray[np.float64]  # in the numbers of the file; NaN if the file has none


def origin_of(boxes: Iterable[FirstBox], held: Held) -> int | None:
    """Return the number of the first pixel, 0 or 1; None if the first boxes do not show one.

    `held`: see `Layout.held`.
    """
    matching = [
        {
            origin
            for origin in _ORIGINS
            if np.abs(held(_counted_from(origin, box.expected)) - box.stored)[:2].max() < _SAME
        }
        for box in boxes
        if np.isfinite(box.stored).all()
    ]
    common = set.intersection(*matching) if matching else set()
    return min(common) if common else None


def check_first_boxes(boxes: Sequence[FirstBox], rows: NDArray[np.float64], held: Held) -> str:
    """Refuse boxes that are corners; return a message on first boxes that do not fit, else "".

    `rows`: all boxes of the file, shape (n, 4). Raises `ExchangeError` if a first box fits much
    better as corners `x1, y1, x2, y2`.
    """
    finite = rows[np.isfinite(rows).all(axis=1)]
    in_order = (finite[:, 2:] >= finite[:, :2]).all(axis=1)  # of boxes without size, too
    can_be_corners = bool(in_order.sum() >= _ORDERED * len(finite))
    misfits = []
    for box in boxes:
        if not np.isfinite(box.stored).all():
            continue
        fit = max(
            _overlap(held(_counted_from(origin, box.expected)), box.stored) for origin in _ORIGINS
        )
        as_corners = _fit_of_corners(box)
        closer = 1 - as_corners < (1 - fit) / _BETTER
        if can_be_corners and fit < _CERTAIN and as_corners >= _CORNERS and closer:
            raise ExchangeError(
                f"{box.place}: the first box {_text(box.stored)} fits the ground truth "
                f"{_text(box.expected)} as corners x1, y1, x2, y2 (overlap {as_corners:.2f}, "
                f"else {fit:.2f}). Expected: x, y, width, height. Convert all boxes: subtract x1 "
                "from x2 and y1 from y2."
            )
        if fit < _FITS:
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


def _counted_from(origin: int, box: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(box + [origin, origin, 0, 0])


def _fit_of_corners(box: FirstBox) -> float:
    """Return the best overlap of a box read as corners, the last pixel included or not."""
    x1, y1, x2, y2 = box.stored.tolist()
    return max(
        _overlap(
            _counted_from(origin, box.expected),
            np.array([x1, y1, x2 - x1 + inclusive, y2 - y1 + inclusive]),
        )
        for origin, inclusive in product(_ORIGINS, (0, 1))
    )


def _overlap(expected: NDArray[np.float64], stored: NDArray[np.float64]) -> float:
    return float(np.nan_to_num(overlap(expected, stored))[0])


def _text(box: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:g}' for value in box)})"
