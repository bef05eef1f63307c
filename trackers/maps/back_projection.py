"""Hue back-projection and mean shift over it, in exact integers.

A pixel's weight is the count of its hue bin in the template; divided by the largest count it is the
back-projection in [0, 1] (Wang & Tang 2010, section 2.1.1, hue alone). Sums of counts are whole
numbers, so no order of summation can change a result.
"""

from math import floor, sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Image
from trackmark.trackers.base.parameters import TrackerError

Weights: TypeAlias = NDArray[np.int64]
Bins: TypeAlias = NDArray[np.uint8]

_UNVISITED = 255
SMALLEST_WINDOW = 3  # pixels a side that Bradski's rule never goes below
MOST_BINS = 254  # of the 256 values of a byte one is `_UNVISITED`, one the bin of masked pixels


class HueBins(NamedTuple):
    """A frame and the hue bins of those of its pixels that were visited so far.

    The kernels bin a pixel when they first come to it: a tracker alone pays for its window,
    trackers in lock step take what others binned before. The bins are the same either way.
    """

    image: Image  # BGR, read-only
    bins: Bins  # (height, width): n_bins where masked, 255 where no kernel has been
    n_bins: int  # at most `MOST_BINS`
    minimum_saturation: float  # pixels below it are masked [fraction]
    minimum_value: float  # those below it, too [fraction]
    maximum_value: float  # and those above it [fraction]


def unvisited_hues(image: Image, n_bins: int, *limits: float) -> HueBins:
    """Hue bins of a frame of which no pixel has been visited; limits as in `HueBins`."""
    return HueBins(image, np.full(image.shape[:2], _UNVISITED, np.uint8), n_bins, *limits)


@njit(cache=True)
def hue_bin(blue: int, green: int, red: int, n_bins: int) -> int:
    """Hue bin in `range(n_bins)`, in integers so that no rounding moves an edge; grey is 0.

    Hue as MATLAB's `rgb2hsv` has it, from red through green and blue.

    Examples
    --------
    >>> [hue_bin(0, 0, 255, 6), hue_bin(0, 255, 0, 6), hue_bin(255, 0, 0, 6)]
    [0, 2, 4]
    """
    b, g, r = np.int64(blue), np.int64(green), np.int64(red)
    largest = max(b, g, r)
    spread = largest - min(b, g, r)
    if spread == 0:
        return 0
    if largest == r:
        sixths = g - b if g >= b else g - b + 6 * spread
    elif largest == g:
        sixths = b - r + 2 * spread
    else:
        sixths = r - g + 4 * spread
    return int(n_bins * sixths // (6 * spread))


@njit(cache=True)
def _visit(hues: HueBins, row: int, column: int) -> int:
    """Work out and keep the bin of a pixel that no kernel has come to."""
    image = hues.image
    blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
    largest = max(blue, green, red)
    spread = largest - min(blue, green, red)
    masked = (
        spread < hues.minimum_saturation * largest
        or largest < hues.minimum_value * 255.0
        or largest > hues.maximum_value * 255.0
    )
    found = int(hues.n_bins if masked else hue_bin(blue, green, red, hues.n_bins))
    hues.bins[row, column] = found
    return found


@njit(cache=True)
def bin_counts(hues: HueBins, left: int, top: int, width: int, height: int) -> Weights:
    """Count a window's pixels inside the image by bin (n_bins + 1,); masked ones count 0."""
    bins = hues.bins
    rows, columns = bins.shape
    counts = np.zeros(hues.n_bins + 1, np.int64)
    for row in range(max(top, 0), min(top + height, rows)):
        for column in range(max(left, 0), min(left + width, columns)):
            found = bins[row, column]
            if found == _UNVISITED:
                found = _visit(hues, row, column)
            counts[found] += 1
    counts[hues.n_bins] = 0
    return counts


@njit(cache=True)
def moments(
    hues: HueBins, weights: Weights, left: int, top: int, width: int, height: int
) -> tuple[int, int, int]:
    """Sum w, w · column and w · row over a window's pixels inside; `weights` are by bin."""
    bins = hues.bins
    rows, columns = bins.shape
    first, last = max(left, 0), min(left + width, columns)
    total, total_x, total_y = 0, 0, 0
    for row in range(max(top, 0), min(top + height, rows)):
        row_total = 0
        for column in range(first, last):
            found = bins[row, column]
            if found == _UNVISITED:
                found = _visit(hues, row, column)
            weight = weights[found]
            row_total += weight
            total_x += weight * column
        total += row_total
        total_y += row_total * row
    return total, total_x, total_y


@njit(cache=True)
def first_pixel(centre: float, size: int) -> int:
    """First pixel of a window of `size` pixels around `centre` (pixels, continuous, from 0)."""
    return int(np.floor(centre - size / 2 + 0.5))


@njit(cache=True)
def mean_shift(
    hues: HueBins,
    weights: Weights,
    x: float,
    y: float,
    width: int,
    height: int,
    stop_distance: float,
    max_iterations: int,
) -> tuple[float, float, int, int]:
    """Move a window to the centroid of its weights until it rests (Wang & Tang, eqs. 6, 7).

    A step shorter than `stop_distance` [pixels] is the last. Gives its centre, the windows whose
    centroid was asked for, and the weight in the last one; where a window holds no weight it stays.
    """
    for iteration in range(1, max_iterations + 1):
        total, total_x, total_y = moments(
            hues, weights, first_pixel(x, width), first_pixel(y, height), width, height
        )
        if total == 0:
            return x, y, iteration, 0
        new_x, new_y = total_x / total + 0.5, total_y / total + 0.5
        step = np.hypot(new_x - x, new_y - y)
        x, y = new_x, new_y
        if step < stop_distance:
            break
    total, _, _ = moments(
        hues, weights, first_pixel(x, width), first_pixel(y, height), width, height
    )
    return x, y, iteration, total


def whole_window(box: Box) -> tuple[int, int]:
    """Return width and height of a box in whole pixels, at least one; TrackerError for no area."""
    if not (box[2] > 0 and box[3] > 0):
        raise TrackerError(f"the box {box.tolist()} has no area; give another.")
    return max(1, floor(float(box[2]) + 0.5)), max(1, floor(float(box[3]) + 0.5))


def adapted_window(weight: float, ratio: float, image_shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the next window's size by Bradski's rule (Intel Techn. J. Q2, 1998) [pixels].

    2 √(M₀₀ · ratio) and 2 √(M₀₀ / ratio), at least 3 pixels and at most the image's; `weight` is
    M₀₀, `ratio` the target's width over its height.
    """
    width = floor(2 * sqrt(weight * ratio) + 0.5)
    height = floor(2 * sqrt(weight / ratio) + 0.5)
    return (
        min(max(width, SMALLEST_WINDOW), image_shape[1]),
        min(max(height, SMALLEST_WINDOW), image_shape[0]),
    )
