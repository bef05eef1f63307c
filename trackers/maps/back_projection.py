"""Hue back-projection and mean shift on it, in exact integers.

The weight of a pixel is the count of its hue bin in the template. Weights divided by the largest
count are the back-projection in [0, 1] (Wang & Tang 2010, section 2.1.1, hue alone). Sums are
integers, so the order of summation does not change results.
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

_NOT_COMPUTED = 255
MIN_WINDOW = 3  # minimum side of a window by Bradski's rule [pixels]
MAX_BINS = 254  # a byte also encodes `_NOT_COMPUTED` and the bin of masked pixels


class HueBins(NamedTuple):
    """Frame with the hue bins that were computed so far.

    Kernels compute the bin of a pixel on first access: bins outside a tracker's windows are not
    computed. Trackers that share the frame reuse the bins.
    """

    image: Image  # BGR, read-only
    bins: Bins  # (height, width): n_bins for masked pixels, 255 if not yet computed
    n_bins: int  # at most `MAX_BINS`
    minimum_saturation: float  # pixels with a lower saturation are masked [fraction]
    minimum_value: float  # pixels with a lower value are masked [fraction]
    maximum_value: float  # pixels with a higher value are masked [fraction]


def lazy_hue_bins(image: Image, n_bins: int, *limits: float) -> HueBins:
    """Return a frame's hue bins, none of which is computed yet; limits as in `HueBins`."""
    return HueBins(image, np.full(image.shape[:2], _NOT_COMPUTED, np.uint8), n_bins, *limits)


@njit(cache=True)
def hue_bin(blue: int, green: int, red: int, n_bins: int) -> int:
    """Return the hue bin in `range(n_bins)`, by integer arithmetic without rounding; grey is 0.

    Hue is defined as in MATLAB's `rgb2hsv`, from red through green and blue.

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
def _compute_bin(hues: HueBins, row: int, column: int) -> int:
    """Compute and store the bin of a pixel."""
    image = hues.image
    blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
    largest = max(blue, green, red)
    spread = largest - min(blue, green, red)
    masked = (
        spread < hues.minimum_saturation * largest
        or largest < hues.minimum_value * 255.0
        or largest > hues.maximum_value * 255.0
    )
    code = int(hues.n_bins if masked else hue_bin(blue, green, red, hues.n_bins))
    hues.bins[row, column] = code
    return code


@njit(cache=True)
def count_bins(hues: HueBins, left: int, top: int, width: int, height: int) -> Weights:
    """Count a window's pixels in the image by bin, (n_bins + 1,); the last count (masked) is 0."""
    bins = hues.bins
    rows, columns = bins.shape
    counts = np.zeros(hues.n_bins + 1, np.int64)
    for row in range(max(top, 0), min(top + height, rows)):
        for column in range(max(left, 0), min(left + width, columns)):
            code = bins[row, column]
            if code == _NOT_COMPUTED:
                code = _compute_bin(hues, row, column)
            counts[code] += 1
    counts[hues.n_bins] = 0
    return counts


@njit(cache=True)
def window_moments(
    hues: HueBins, weights: Weights, left: int, top: int, width: int, height: int
) -> tuple[int, int, int]:
    """Return Σ w, Σ w · column and Σ w · row of a window's pixels; `weights` (n_bins + 1,)."""
    bins = hues.bins
    rows, columns = bins.shape
    first, last = max(left, 0), min(left + width, columns)
    total, total_x, total_y = 0, 0, 0
    for row in range(max(top, 0), min(top + height, rows)):
        row_total = 0
        for column in range(first, last):
            code = bins[row, column]
            if code == _NOT_COMPUTED:
                code = _compute_bin(hues, row, column)
            weight = weights[code]
            row_total += weight
            total_x += weight * column
        total += row_total
        total_y += row_total * row
    return total, total_x, total_y


@njit(cache=True)
def first_pixel(centre: float, size: int) -> int:
    """Return the first pixel of a window of `size` pixels around `centre` [pixels]."""
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
    """Move a window to the centroid of its weights until convergence (Wang & Tang, eqs. 6, 7).

    Mean shift stops after a step below `stop_distance` [pixels]. Returns centre x and y [pixels],
    the number of computed centroids, and Σ w in the final window. A window without weight is not
    moved.
    """
    for iteration in range(1, max_iterations + 1):
        total, total_x, total_y = window_moments(
            hues, weights, first_pixel(x, width), first_pixel(y, height), width, height
        )
        if total == 0:
            return x, y, iteration, 0
        new_x, new_y = total_x / total + 0.5, total_y / total + 0.5
        step = np.hypot(new_x - x, new_y - y)
        x, y = new_x, new_y
        if step < stop_distance:
            break
    total, _, _ = window_moments(
        hues, weights, first_pixel(x, width), first_pixel(y, height), width, height
    )
    return x, y, iteration, total


def window_size(box: Box) -> tuple[int, int]:
    """Return width and height in whole pixels, ≥ 1; raise TrackerError if the area is not > 0."""
    if not (box[2] > 0 and box[3] > 0):
        raise TrackerError(f"the box {box.tolist()} has no area. Use another box.")
    return max(1, floor(float(box[2]) + 0.5)), max(1, floor(float(box[3]) + 0.5))


def adapted_window(weight: float, ratio: float, image_shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the next window's size by Bradski's rule (Intel Techn. J. Q2, 1998) [pixels].

    The width is 2 √(M₀₀ · ratio), the height 2 √(M₀₀ / ratio), both clipped to [3, image size].
    `weight` is M₀₀; `ratio` is width / height of the target.
    """
    width = floor(2 * sqrt(weight * ratio) + 0.5)
    height = floor(2 * sqrt(weight / ratio) + 0.5)
    return (
        min(max(width, MIN_WINDOW), image_shape[1]),
        min(max(height, MIN_WINDOW), image_shape[0]),
    )
