"""Sums over the pixels inside contours, by Green's theorem.

A pixel is inside if its centre is, and the rule is half-open: where a contour passes through
centres, they are inside on its left and its upper side alone, so that contours that share a side
share no pixel. Sums run down the columns, where a row is added to the one above in one go; a
contour's sum is then a difference of two numbers for each column and each time that it is crossed.
"""

from math import ceil
from typing import Literal, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Outside", "contour_scores", "windings"]

Tables: TypeAlias = NDArray[np.float32]
Cells: TypeAlias = NDArray[np.int32]
Indices: TypeAlias = NDArray[np.intp]
Array: TypeAlias = NDArray[np.float64]
Outside: TypeAlias = Literal["window", "image"]


def contour_scores(
    tables: Tables,
    cells: Cells,
    which: Indices,
    contours: Array,
    window: tuple[int, int, int, int],
    outside: Outside = "window",
    smallest: int = 60,
) -> Array:
    """How much more of a map is inside a contour than outside, each contour in a map of its own.

    Parameters
    ----------
    tables : ndarray of float32, shape (maps, k)
        The maps: the value of each of k cells (colours, say).
    cells : ndarray of int32, shape (height, width)
        The image: each pixel's cell, in [0, k).
    which, contours : ndarray of intp, shape (n,), of float64, shape (n, points, 2)
        The map of each contour, and the contours [pixels]; none crosses itself.
    window : tuple of int
        First column and row, and those after the last, within the image. All contours had better
        lie in it: what is beyond counts as outside.
    outside : {'window', 'image'}
        Where the pixels outside are taken from.
    smallest : int
        Pixels that a contour must have inside.

    Returns
    -------
    ndarray of float64, shape (n,)
        Mean of the map inside less that outside; -1 where fewer than `smallest` pixels are
        inside, or none is outside.
    """
    left, top, right, bottom = window
    seen = np.ascontiguousarray(cells[top:bottom, left:right])
    beyond = np.zeros(0, np.intp)
    if outside == "image":
        k = tables.shape[1]
        beyond = np.bincount(cells.ravel(), minlength=k) - np.bincount(seen.ravel(), minlength=k)
    order = np.argsort(which, kind="stable")  # each map's sums are made once
    scores: Array = _scores(tables, seen, which, order, contours, left, top, beyond, smallest)
    return scores


@njit(cache=True)
def windings(contour: Array, height: int, width: int) -> Cells:
    """How many times a contour (points, 2) goes round the centre of each pixel of an image.

    The sign is the direction.
    """
    turns = np.zeros((height + 1, width), np.int32)
    for i in range(len(contour)):
        left, low, right, high, sign = _directed(contour, i)
        start, stop = _columns(left, right, 0, width)
        for column in range(start, stop):
            turns[_row(column + 0.5, left, low, right, high, 0, height), column] += sign
    for row in range(1, height):
        turns[row] += turns[row - 1]
    return turns[:height]


@njit(cache=True)
def _scores(
    tables: Tables,
    cells: Cells,
    which: Indices,
    order: Indices,
    contours: Array,
    left: int,
    top: int,
    beyond: Indices,
    smallest: int,
) -> Array:
    height, width = cells.shape
    scores = np.full(len(contours), -1.0)
    above = np.zeros((height + 1, width))
    pixels = height * width + beyond.sum()
    total, current = 0.0, -1
    for j in order:
        if which[j] != current:
            current = which[j]
            table = tables[current]
            for row in range(height):
                for column in range(width):
                    value = table[np.uintp(cells[row, column])]
                    above[row + 1, column] = above[row, column] + value
            total = above[height].sum()
            for cell in range(len(beyond)):
                total += beyond[cell] * np.float64(table[cell])
        inside, count = _inside(above, contours[j], left, top)
        if smallest <= count < pixels and count > 0:
            scores[j] = inside / count - (total - inside) / (pixels - count)
    return scores


@njit(cache=True)
def _inside(above: Array, contour: Array, window_left: int, window_top: int) -> tuple[float, int]:
    """Sum and number of the pixels inside; `above` holds the sums above each row of a window."""
    height, width = above.shape[0] - 1, above.shape[1]
    total, count = 0.0, 0
    for i in range(len(contour)):
        left, low, right, high, sign = _directed(contour, i)
        start, stop = _columns(left, right, window_left, width)
        for column in range(start, stop):
            centre = column + window_left + 0.5
            row = _row(centre, left, low, right, high, window_top, height)
            total += sign * above[row, column]
            count += sign * row
    if count < 0:  # the contour runs the other way
        return -total, -count
    return total, count


@njit(cache=True)
def _directed(contour: Array, i: int) -> tuple[float, float, float, float, int]:
    """The side after point i from left to right, x and y of its ends, and which way it runs.

    Both contours that share a side find the same crossings, as they compute the same.
    """
    x, y = contour[i]
    next_x, next_y = contour[i + 1 if i + 1 < len(contour) else 0]
    if x <= next_x:
        return x, y, next_x, next_y, -1
    return next_x, next_y, x, y, 1


@njit(cache=True)
def _columns(left: float, right: float, origin: int, width: int) -> tuple[int, int]:
    """Columns of a window whose centres are in [left, right), from the first to after the last."""
    first, last = max(ceil(left - 0.5), origin), min(ceil(right - 0.5), origin + width)
    if not first < last:
        return 0, 0
    return first - origin, last - origin


@njit(cache=True)
def _row(
    x: float, left: float, low: float, right: float, high: float, origin: int, height: int
) -> int:
    """Rows of a window whose centres are above where a side crosses x."""
    y = low + (x - left) * (high - low) / (right - left) - (origin + 0.5)
    if not y > 0.0:
        return 0
    return ceil(y) if y < height else height
