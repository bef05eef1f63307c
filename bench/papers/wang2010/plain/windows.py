"""Windows of whole pixels, the sum of a map in them, and mean shift (equations 6 and 7)."""

from math import floor, hypot

import numpy as np
from numpy.typing import NDArray

__all__ = ["mean_shift", "whole_size", "window_slices", "window_sum"]

Map = NDArray[np.float64]

NOTHING = 1e-9  # a window whose sum is no more than this stays where it is
ROUNDING = 1e-9  # pixels that a centroid in floats may be off: what should be on an edge is on it


def whole_size(size: float) -> int:
    """Pixels of a window that stands for this length, at least one."""
    return max(1, floor(size + 0.5))


def window_slices(
    shape: tuple[int, ...], x: float, y: float, width: int, height: int
) -> tuple[slice, slice]:
    """Rows and columns of the window around a centre that lie in an image of this shape."""
    left = floor(x - width / 2 + 0.5 + ROUNDING)
    top = floor(y - height / 2 + 0.5 + ROUNDING)
    rows, columns = shape[:2]
    return (
        slice(min(max(top, 0), rows), min(max(top + height, 0), rows)),
        slice(min(max(left, 0), columns), min(max(left + width, 0), columns)),
    )


def window_sum(values: Map, x: float, y: float, width: int, height: int) -> float:
    """M00 of the window around a centre."""
    return float(values[window_slices(values.shape, x, y, width, height)].sum())


def mean_shift(
    joint: Map,
    x: float,
    y: float,
    width: int,
    height: int,
    stop_distance: float = 2.0,
    max_iterations: int = 10,
) -> tuple[float, float, int, float]:
    """Move a window to the centroid of a map until a step is short.

    Parameters
    ----------
    joint : ndarray of float64, shape (rows, columns)
        The map.
    x, y : float
        Centre to start from [pixels, continuous coordinates].
    width, height : int
        Size of the window [pixels].
    stop_distance : float
        A step shorter than this is the last one taken [pixels].
    max_iterations : int
        Most steps taken.

    Returns
    -------
    x, y : float
        Centre; that of a window without anything in it stays.
    iterations : int
        Windows whose centroid was asked for.
    total : float
        M00 of the window around the centre that is returned.
    """
    for iteration in range(1, max_iterations + 1):
        rows, columns = window_slices(joint.shape, x, y, width, height)
        inside = joint[rows, columns]
        total = float(inside.sum())
        if total <= NOTHING:
            return x, y, iteration, total
        new_x = inside.sum(axis=0) @ np.arange(columns.start, columns.stop) / total + 0.5
        new_y = inside.sum(axis=1) @ np.arange(rows.start, rows.stop) / total + 0.5
        step = hypot(new_x - x, new_y - y)
        x, y = float(new_x), float(new_y)
        if step < stop_distance:
            break
    return x, y, iteration, window_sum(joint, x, y, width, height)
