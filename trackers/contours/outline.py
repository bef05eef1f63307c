"""Contours and masks: conversion, enclosed area, and sums over the inside.

A pixel is inside if its centre is inside. Centres on the contour are inside on its left and upper
sides only, so that contours with a common side have no common pixel. Sums use Green's theorem: with
cumulative sums down the columns, the sum over a contour's inside needs one table look-up per side
and column.
"""

from math import ceil
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Indices
from trackmark.trackers.base.interface import Box, Mask

Tables: TypeAlias = NDArray[np.float32]
Cells: TypeAlias = NDArray[np.int32]

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
    """Return the mean of a map inside each contour minus the mean outside, shape (n,).

    `tables` float32 (maps, k): value of each map in each of k cells.
    `cells` int32 (height, width): cell of each pixel.
    `which` int (n,): map of each contour.
    `contours` float64 (n, points, 2): contours without self-intersections [pixels].
    `window`: left, top, right and bottom (exclusive) in the image. Pixels beyond it are outside.
    `outside` {"window", "image"}: region whose pixels can be outside.
    `smallest`: minimum number of pixels inside; with fewer, or with none outside, the score is -1.
    """
    left, top, right, bottom = window
    seen = np.ascontiguousarray(cells[top:bottom, left:right])
    beyond = np.zeros(0, np.intp)
    if outside == "image":
        k = tables.shape[1]
        beyond = np.bincount(cells.ravel(), minlength=k) - np.bincount(seen.ravel(), minlength=k)
    order = np.argsort(which, kind="stable")  # each map is summed once
    scores: Array = _scores(tables, seen, which, order, contours, left, top, beyond, smallest)
    return scores


@njit(cache=True)
def _turns(contour: Array, window_left: int, window_top: int, height: int, width: int) -> Cells:
    """Return turns (height + 1, width), of which the sums down a column are winding numbers."""
    turns = np.zeros((height + 1, width), np.int32)
    for i in range(len(contour)):
        left, low, right, high, sign = _left_to_right(contour, i)
        start, stop = _columns(left, right, window_left, width)
        for column in range(start, stop):
            centre = column + window_left + 0.5
            turns[_row(centre, left, low, right, high, window_top, height), column] += sign
    return turns


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
    """Return sum and number of the pixels inside; `above`: cumulative sums down the columns."""
    height, width = above.shape[0] - 1, above.shape[1]
    total, count = 0.0, 0
    for i in range(len(contour)):
        left, low, right, high, sign = _left_to_right(contour, i)
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
def _left_to_right(contour: Array, i: int) -> tuple[float, float, float, float, int]:
    """Return the two ends of the side from point i to the next point, and a sign.

    The left end comes first. The sign is -1 if the side goes to the right, otherwise 1.
    """
    following = i + 1 if i + 1 < len(contour) else 0
    x, y = contour[i, 0], contour[i, 1]
    next_x, next_y = contour[following, 0], contour[following, 1]
    if x <= next_x:
        return x, y, next_x, next_y, -1
    return next_x, next_y, x, y, 1


@njit(cache=True)
def _columns(left: float, right: float, origin: int, width: int) -> tuple[int, int]:
    """Return the range (end exclusive) of a window's columns with centres in [left, right)."""
    first, last = max(ceil(left - 0.5), origin), min(ceil(right - 0.5), origin + width)
    if not first < last:
        return 0, 0
    return first - origin, last - origin


@njit(cache=True)
def _row(
    x: float, left: float, low: float, right: float, high: float, origin: int, height: int
) -> int:
    """Return the number of a window's rows whose centres are above a side at x."""
    y = low + (x - left) * (high - low) / (right - left) - (origin + 0.5)
    if not y > 0.0:
        return 0
    return ceil(y) if y < height else height


def outline(mask: Mask, points: int = 32) -> Array:
    """Return the outer boundary of a mask's largest part, (points, 2) [pixels], equally spaced.

    The boundary passes half-way between the centres of inside and outside neighbours. It runs
    clockwise on the screen and starts at its topmost point (of several, the leftmost). Pixels that
    touch at a corner are connected. Raises ValueError for an empty mask.
    """
    if not mask.any():
        raise ValueError(
            "the mask has no pixel, so it has no outline. Use a mask with at least one pixel."
        )
    # A grid twice as fine contains the points half-way between two centres.
    height, width = mask.shape
    fine = np.zeros((2 * height + 1, 2 * width + 1), np.uint8)
    fine[1::2, 1::2] = mask
    interpolation = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]], np.float32)
    fine = cv2.filter2D(fine, -1, interpolation, borderType=cv2.BORDER_CONSTANT) >= 2
    chains, _ = cv2.findContours(fine.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    chain = max(chains, key=cv2.contourArea)[::-1, 0]
    first = np.lexsort(chain.T)[0]
    return equally_spaced(np.roll(chain, -first, axis=0) / 2, points)


def fill_contour(contour: Array, height: int, width: int) -> Mask:
    """Return the mask of a contour (points, 2), by the rule in the module docstring."""
    winding_numbers = np.cumsum(_turns(contour, 0, 0, height, width)[:height], axis=0)
    inside: Mask = winding_numbers != 0
    return inside


def bounding_box(contour: Array) -> Box:
    """Return the bounding box (4,) of a contour (points, 2)."""
    minimum = contour.min(axis=0)
    return np.concatenate([minimum, contour.max(axis=0) - minimum])


def inscribed_ellipse(box: Box, height: int, width: int) -> Mask:
    """Return the mask of the ellipse inscribed in a box."""
    half = box[2:] / 2
    centre = box[:2] + half
    x = (np.arange(width) + 0.5 - centre[0]) / half[0]
    y = (np.arange(height) + 0.5 - centre[1]) / half[1]
    inside: Mask = x**2 + y[:, None] ** 2 <= 1
    return inside


def enclosed_area(contour: Array) -> float:
    """Return the area that a contour encloses [square pixels].

    Examples
    --------
    >>> enclosed_area(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]))
    6.0
    """
    x, y = (contour - contour[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def crosses_itself(contour: Array) -> bool:
    """Return whether two non-adjacent sides of a contour have a common point."""
    n = len(contour)
    a, b = np.triu_indices(n, 2)
    apart = (a > 0) | (b < n - 1)  # the last side is the first one's neighbour
    a, b = a[apart], b[apart]
    ends = np.roll(contour, -1, axis=0)
    minimum, maximum = np.minimum(contour, ends), np.maximum(contour, ends)
    near = ((minimum[a] <= maximum[b]) & (minimum[b] <= maximum[a])).all(axis=1)
    a, b = a[near], b[near]
    return bool((_separates(contour, ends, a, b) & _separates(contour, ends, b, a)).any())


def _separates(starts: Array, ends: Array, a: Indices, b: Indices) -> Mask:
    """Return whether the line through each side a separates or touches the end points of side b."""
    x, y = (ends[a] - starts[a]).T
    start, end = starts[b] - starts[a], ends[b] - starts[a]
    parted: Mask = (x * start[:, 1] - y * start[:, 0]) * (x * end[:, 1] - y * end[:, 0]) <= 0
    return parted


def equally_spaced(contour: Array, points: int) -> Array:
    """Return equally spaced points (points, 2) on a closed contour (n, 2), from its first point."""
    closed = np.concatenate([contour, contour[:1]])
    lengths = np.hypot(*np.diff(closed, axis=0).T)
    passed = np.concatenate([[0.0], lengths.cumsum()])
    places = np.arange(points) / points * passed[-1]
    return np.stack([np.interp(places, passed, closed[:, k]) for k in (0, 1)], axis=1)
