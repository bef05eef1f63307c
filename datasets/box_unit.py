"""Boxes in another unit than `x, y, width, height` in pixels: one rule for truth and results.

`find_other_unit` decides from boxes that are known (the init box of a result file), from the image
size, and from the motion of the target. It returns a unit only if the rows cannot be boxes of
annotators or trackers: callers refuse such files, because every score would be wrong. Rows that
`resemble_corners` can be boxes, but rarely are: callers warn.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CORNERS", "BoxUnit", "find_other_unit", "resemble_corners", "share_outside"]

Array = NDArray[np.float64]

_SLACK = 1.0  # difference of an edge that does not count: first pixel 0 or 1, last pixel excluded
_MIN_DIFFERENCE = 0.1  # difference from a known box up to which rows are boxes [of width + height]
_MIN_GAIN = 4  # minimum ratio of differences, or of changes, as a box to those in the other unit
_MIN_ORDERED = 0.9  # minimum share of rows whose second corner is right of and below the first
_MIN_OUTSIDE = 0.5  # share of a box outside the image above which it cannot be a box
_MIN_ROWS = 5  # minimum number of rows for a decision from their motion
_MIN_MOTION = 20.0  # minimum motion of all rows together for such a decision [pixels]
_MIN_SPREAD_RATIO = 2.0  # minimum spread of second corners, as a multiple of that of the sizes
_MIN_CUT = 0.02  # share of a box outside the image above which the image border cuts it
_MAX_SHARE = 2.0  # largest coordinate of a share of the image size


@dataclass(frozen=True)
class BoxUnit:
    """Unit of the four numbers of a row."""

    name: str
    remedy: str
    convert: Callable[[Array, Array], Array]  # (rows, image width and height) -> boxes in pixels
    tolerance: float  # largest difference from a known box [of width + height]
    needs_size: bool = False  # True if the image size must be known


def _corners(rows: Array, _: Array) -> Array:
    return np.column_stack([rows[:, :2], rows[:, 2:] - rows[:, :2]])


def _centres(rows: Array, _: Array) -> Array:
    return np.column_stack([rows[:, :2] - rows[:, 2:] / 2, rows[:, 2:]])


CORNERS = BoxUnit(
    "corners x1, y1, x2, y2", "subtract x1 from x2 and y1 from y2", _corners, tolerance=0.2
)
SHARES = BoxUnit(
    "shares of the image size",
    "multiply x and width by the width of the images, and y and height by their height",
    lambda rows, size: rows * np.tile(size, 2),
    tolerance=0.05,
    needs_size=True,
)
_UNITS = (
    CORNERS,
    SHARES,
    BoxUnit(
        "centres x, y with width and height",
        "subtract half the width from x and half the height from y",
        _centres,
        tolerance=0.05,
    ),
    BoxUnit(
        "centres and sizes as shares of the image size",
        "subtract half the width from x and half the height from y, then multiply x and width by "
        "the width of the images, and y and height by their height",
        lambda rows, size: _centres(rows * np.tile(size, 2), size),
        tolerance=0.05,
        needs_size=True,
    ),
    BoxUnit(
        "y, x, height, width",
        "exchange the first two and the last two numbers",
        lambda rows, _: rows[:, [1, 0, 3, 2]],
        tolerance=0.05,
    ),
)


def find_other_unit(
    rows: Array, size: tuple[int, int] | None = None, expected: Array | None = None
) -> BoxUnit | None:
    """Return the unit of rows that are not boxes `[x, y, width, height]` in pixels.

    Parameters
    ----------
    rows : array of shape (n, 4)
        Rows as read from a file. Rows that are not finite are ignored.
    size : tuple of int, optional
        Width and height of the images [pixels].
    expected : array of shape (n, 4), optional
        Boxes in pixels that some of the rows must show; NaN in the other rows.

    Returns
    -------
    BoxUnit or None
        The unit, or None if the rows can be boxes in pixels.
    """
    rows = np.asarray(rows, np.float64)
    finite = np.isfinite(rows).all(axis=1) & (np.abs(rows) < 1e9).all(axis=1)
    extent = np.full(2, np.nan) if size is None else np.array(size, np.float64)
    if expected is not None:
        is_known = finite & np.isfinite(expected).all(axis=1)
        unit = _unit_by_expected(rows[is_known], expected[is_known], extent, rows[finite])
        if unit is not None:
            return unit
        finite &= ~is_known  # toolkits write the init box, trackers the other rows
    finite &= rows.any(axis=1)  # zeros stand for a lost target
    return _unit_by_image(rows[finite], size, extent) if finite.any() else None


def resemble_corners(rows: Array, size: tuple[int, int]) -> bool:
    """Return whether rows are more likely to be corners than boxes, although they can be both.

    The second corner is right of and below the first. Moreover, it moves much more than its
    distance from the first corner changes, or the border of the images cuts most rows read as
    boxes, but not the rows read as corners. `rows`: shape (n, 4); `size`: width and height of the
    images.
    """
    rows = rows[np.isfinite(rows).all(axis=1)]
    if not len(rows) or _share_ordered(rows) < _MIN_ORDERED:
        return False
    corners = _corners(rows, np.array(size, np.float64))
    spread, size_spread = (
        np.sqrt(part.var(axis=0).sum()) for part in (rows[:, 2:], corners[:, 2:])
    )
    moves = np.ptp(rows[:, 2:], axis=0).sum() >= _MIN_MOTION
    if moves and spread > _MIN_SPREAD_RATIO * size_spread:
        return True
    cut, cut_as_corners = (
        (np.nan_to_num(share_outside(boxes, size)) > _MIN_CUT).mean() for boxes in (rows, corners)
    )
    return bool(cut > 0.5 and cut_as_corners <= 1 - _MIN_ORDERED)


def share_outside(boxes: Array, size: tuple[int, int]) -> Array:
    """Return the share of each box's area outside an image of this width and height, shape (n,).

    It is NaN for boxes without size.
    """
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    inside = np.clip(np.minimum(high, size) - np.maximum(low, 0.0), 0.0, None).prod(axis=1)
    area = np.where((boxes[:, 2:] > 0).all(axis=1), boxes[:, 2:].prod(axis=1), np.nan)
    return np.asarray(1.0 - inside / area)


def _unit_by_expected(rows: Array, expected: Array, size: Array, all_rows: Array) -> BoxUnit | None:
    """Return the unit in which rows show the expected boxes, if they do not show them as boxes."""
    as_boxes = np.median(_difference(rows, expected)) if len(rows) else 0.0
    if as_boxes <= _MIN_DIFFERENCE:
        return None
    for unit in _UNITS:
        if unit.needs_size and (np.isnan(size).any() or np.abs(all_rows).max() > _MAX_SHARE):
            continue
        if unit is CORNERS and _share_ordered(all_rows) < _MIN_ORDERED:
            continue
        converted = np.median(_difference(unit.convert(rows, size), expected))
        if converted <= unit.tolerance and converted * _MIN_GAIN < as_boxes:
            return unit
    return None


def _unit_by_image(rows: Array, size: tuple[int, int] | None, extent: Array) -> BoxUnit | None:
    """Return the unit of rows that cannot be boxes because of the image size or their motion."""
    if (np.abs(rows) <= 1.0).all() and (rows[:, 2:] > 0.0).any() and (rows % 1.0 > 0).any():
        return SHARES
    corners = _corners(rows, extent)
    if (corners[:, 2:] > 0.0).all() and _moves_as_corners(rows):
        return CORNERS
    if size is None or _share_ordered(rows) < _MIN_ORDERED:
        return None
    fits = (share_outside(corners, size) < 1 - _MIN_ORDERED).mean() >= _MIN_ORDERED
    outside = np.nan_to_num(share_outside(rows, size))
    return CORNERS if fits and np.median(outside) > _MIN_OUTSIDE else None


def _moves_as_corners(rows: Array) -> bool:
    """Return whether the last two numbers move with the first two, as corners of a target do.

    Width and height of a box do not follow its position. Corners do: their distance, the size of
    the target, changes much less than their position.
    """
    if len(rows) < _MIN_ROWS:
        return False
    second = np.abs(np.diff(rows[:, 2:], axis=0)).sum()
    sizes = np.abs(np.diff(rows[:, 2:] - rows[:, :2], axis=0)).sum()
    return bool(second >= _MIN_MOTION and second > _MIN_GAIN * sizes)


def _share_ordered(rows: Array) -> float:
    """Return the share of rows whose numbers can be corners, also of boxes without size."""
    return float((rows[:, 2:] >= rows[:, :2]).all(axis=1).mean())


def _difference(rows: Array, expected: Array) -> Array:
    """Return the differences of all four edges beyond `_SLACK`, relative to width + height."""
    edges, expected_edges = (
        np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]]) for boxes in (rows, expected)
    )
    beyond = np.clip(np.abs(edges - expected_edges) - _SLACK, 0.0, None).sum(axis=1)
    return np.asarray(beyond / expected[:, 2:].sum(axis=1))
