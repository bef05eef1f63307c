"""The joint map in fixed point, its moments in any window, and windows that drift on it.

A weight of the map is a whole number of 2^-bits, `bits` being as many as keep every moment inside
64 bits (40 at 160 x 120, 34 at 640 x 480). Sums of them are exact, so that neither the order of
summation nor the size of the region that was summed can move a box.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Ints
from trackmark.trackers.base.interface import Image
from trackmark.trackers.maps.differences import Sums

Bins: TypeAlias = NDArray[np.int32]


ROUNDING = 1e-9
"""Pixels that a centroid may be off, weights being rounded: what should be on an edge is on it.

Centroids on edges are no rarity: weights are sums of a few counts, so rows of pixels often balance.
"""


class Region(NamedTuple):
    """A rectangle of pixels: columns left to right, rows top to bottom, ends excluded."""

    left: int
    top: int
    right: int
    bottom: int


class Drifted(NamedTuple):
    """Windows after they have moved."""

    points: Array  # (n, 2): their centres x, y [pixels, continuous coordinates from 0]
    iterations: Ints  # (n,): steps that each took
    before: Ints  # (n,): M₀₀ of the windows at the start, in units of 2^-bits
    after: Ints  # (n,): M₀₀ at the end


class Binning(NamedTuple):
    """How colours are binned, and which pixels weigh nothing [fractions]."""

    hues: int
    saturations: int
    minimum_saturation: float
    minimum_value: float
    maximum_value: float


def weight_bits(rows: int, columns: int) -> int:
    """Binary places of a weight in [0, 1] such that no moment over an image overflows, 1 to 40.

    Examples
    --------
    >>> weight_bits(115, 142), weight_bits(480, 640), weight_bits(2160, 3840)
    (40, 34, 27)
    """
    most = rows * columns * max(rows, columns)
    return min(40, 62 - most.bit_length())


@njit(cache=True)
def window_at(x: float, y: float, width: int, height: int, rows: int, columns: int) -> Region:
    """Pixels of a window around (x, y) that are in the image; none for a window outside it."""
    left = int(np.floor(x - width / 2 + 0.5 + ROUNDING))
    top = int(np.floor(y - height / 2 + 0.5 + ROUNDING))
    first_column, first_row = min(max(left, 0), columns), min(max(top, 0), rows)
    return Region(
        first_column,
        first_row,
        max(min(left + width, columns), first_column),
        max(min(top + height, rows), first_row),
    )


@njit(cache=True)
def region_of(points: Array, width: int, height: int, rows: int, columns: int) -> Region:
    """Smallest region with the windows of one size at all points (n, 2); see `window_at`."""
    left, top, right, bottom = columns, rows, 0, 0
    for x, y in points:
        window = window_at(x, y, width, height, rows, columns)
        left, top = min(left, window.left), min(top, window.top)
        right, bottom = max(right, window.right), max(bottom, window.bottom)
    return Region(left, top, right, bottom)


@njit(cache=True, error_model="numpy")
def colour_bins(image: Image, row: int, left: int, right: int, binning: Binning, out: Bins) -> None:
    """Joint hue and saturation bins of a stretch of a row into `out`, shape (right - left,).

    Hue and saturation as MATLAB's `rgb2hsv` has them; the bin is hue · `saturations` + saturation,
    and `hues` · `saturations` for a pixel below either minimum or above the maximum.

    The quotients of whole numbers are exact although computed as float32: half a unit more in
    the numerator keeps them further from the next whole number than float32 can err, and the
    loop takes several pixels at once.
    """
    n_hues, n_saturations = np.float32(binning.hues), np.float32(binning.saturations)
    half, one, six = np.float32(0.5), np.float32(1), np.float32(6)
    highest = np.float32(binning.saturations - 1)
    masked = np.int32(binning.hues * binning.saturations)
    least_saturation = np.float32(binning.minimum_saturation)
    least_value = np.float32(binning.minimum_value * 255)
    most_value = np.float32(binning.maximum_value * 255)
    length = right - left
    channels = np.empty((3, length), np.float32)
    pixels = image[row, left:right]
    for column in range(length):
        channels[0, column] = pixels[column, 0]
        channels[1, column] = pixels[column, 1]
        channels[2, column] = pixels[column, 2]
    for column in range(length):
        blue, green, red = channels[0, column], channels[1, column], channels[2, column]
        largest = max(max(blue, green), red)
        spread = largest - min(min(blue, green), red)
        from_red = green - blue + (six * spread if green < blue else np.float32(0))
        from_green = blue - red + np.float32(2) * spread
        from_blue = red - green + np.float32(4) * spread
        sixths = from_red if largest == red else (from_green if largest == green else from_blue)
        hue = np.int32((n_hues * sixths + half) / (six * max(spread, one)))
        saturation = np.int32(min((n_saturations * spread + half) / max(largest, one), highest))
        passes = (
            spread >= least_saturation * largest
            and largest >= least_value
            and largest <= most_value
        )
        out[column] = hue * np.int32(binning.saturations) + saturation if passes else masked


@njit(cache=True)
def summed(
    image: Image,
    region: Region,
    latest: Sums,
    earlier: Sums,
    threshold: float,
    weights: Ints,
    binning: Binning,
) -> Ints:
    """Integral image of the joint map P (eq. 5) and of its first moments over a region.

    A pixel moves where the sum of the local differences D¹ and D² (height, width) exceeds the
    threshold. `weights` (2, hues · saturations + 1) are P of each colour where nothing moves, and
    where it does, in units of 2^-bits. Gives sums of P, column · P and row · P over the region's
    part above and left of each pixel, (rows + 1, columns + 1, 3).
    """
    left, top, right, bottom = region
    columns = right - left
    limit = np.int32(np.floor(threshold))  # of whole numbers just those above it exceed it
    sums = np.empty((bottom - top + 1, columns + 1, 3), np.int64)
    sums[0] = 0
    bins = np.empty(columns, np.int32)
    for row in range(top, bottom):
        colour_bins(image, row, left, right, binning, bins)
        total, total_x = np.int64(0), np.int64(0)
        above, here = sums[row - top], sums[row - top + 1]
        here[0] = 0
        first, second = latest[row, left:right], earlier[row, left:right]
        for column in range(columns):
            moves = np.int32(first[column]) + np.int32(second[column]) > limit
            weight = weights[1 if moves else 0, bins[column]]
            total += weight
            total_x += weight * (left + column)
            here[column + 1, 0] = above[column + 1, 0] + total
            here[column + 1, 1] = above[column + 1, 1] + total_x
            here[column + 1, 2] = above[column + 1, 2] + total * row
    return sums


@njit(cache=True)
def holds(region: Region, window: Region) -> bool:
    """Whether a region holds all of a window."""
    return (
        window.left >= region.left
        and window.top >= region.top
        and window.right <= region.right
        and window.bottom <= region.bottom
    )


@njit(cache=True)
def window_moments(sums: Ints, region: Region, window: Region) -> tuple[int, int, int]:
    """M₀₀, M₁₀ and M₀₁ of a window (eq. 6) that the region of the sums holds."""
    left, right = window.left - region.left, window.right - region.left
    upper, lower = sums[window.top - region.top], sums[window.bottom - region.top]
    return (
        lower[right, 0] - upper[right, 0] - lower[left, 0] + upper[left, 0],
        lower[right, 1] - upper[right, 1] - lower[left, 1] + upper[left, 1],
        lower[right, 2] - upper[right, 2] - lower[left, 2] + upper[left, 2],
    )


@njit(cache=True)
def drift(
    sums: Ints,
    region: Region,
    rows: int,
    columns: int,
    points: Array,
    width: int,
    height: int,
    stop_distance: float,
    max_iterations: int,
) -> tuple[Drifted, Region]:
    """Mean shift of many windows of one size (eqs. 6 and 7).

    Each moves from its point (n, 2) to the centroid of its weights until a step was shorter than
    `stop_distance` [pixels] or there were `max_iterations`; 0 leaves them where they are. A window
    without any weight stays. Its part outside the image counts nothing. `sums` are those of
    `summed` over `region`, `rows` and `columns` those of the image.

    Gives where the windows have come to, and a window that the region does not hold: where there is
    one, the former counts for nothing; (0, 0, 0, 0) where it held them all.
    """
    n = len(points)
    moved = Drifted(
        points.copy(), np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    )
    for i in range(n):
        x, y = points[i]
        step = np.inf
        iterations = 0
        while True:
            window = window_at(x, y, width, height, rows, columns)
            if not holds(region, window):
                return moved, window
            total, total_x, total_y = window_moments(sums, region, window)
            if iterations == 0:
                moved.before[i] = total
            if total == 0 or step < stop_distance or iterations == max_iterations:
                break
            new_x, new_y = total_x / total + 0.5, total_y / total + 0.5
            step = np.hypot(new_x - x, new_y - y)
            x, y = new_x, new_y
            iterations += 1
        moved.points[i, 0], moved.points[i, 1] = x, y
        moved.iterations[i] = iterations
        moved.after[i] = total
    return moved, Region(0, 0, 0, 0)
