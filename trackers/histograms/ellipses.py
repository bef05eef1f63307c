"""Kernel-weighted colour histograms of upright ellipses, and mean shift towards a model histogram.

A pixel belongs to an ellipse if the pixel's centre is inside. Its weight is 65536 minus one
decrement per axis. Decrements increase with the distance from the ellipse's centre. They are
rounded down to integers, so sums do not depend on the order.
"""

from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Codes

Counts: TypeAlias = NDArray[np.int64]
Kernel: TypeAlias = Literal["isotropic", "epanechnikov", "uniform"]
KERNELS: tuple[Kernel, ...] = ("isotropic", "epanechnikov", "uniform")
_ISOTROPIC, _UNIFORM = 0, 2

_FULL = 65536  # weight at the centre


class EllipseCounts(NamedTuple):
    """Histograms of n ellipses."""

    counts: Counts  # (n, m): sum of the pixel weights in each requested bin
    totals: Counts  # (n,): sum of the weights of all pixels
    pixels: Counts  # (n,): number of pixels inside the image


class CodeWindow(NamedTuple):
    """Bin codes of the pixels in a window of an image."""

    codes: Codes  # (window width, window height): bin of each pixel, by column
    left: int  # first column of the window in the image
    top: int  # first row
    width: int  # of the image [pixels]
    height: int


class MeanShiftResult(NamedTuple):
    """Result of mean shift."""

    x: float  # centre [pixels]
    y: float
    coefficient: float  # Bhattacharyya coefficient in [0, 1]; 0 if no pixel has a model bin
    iterations: int  # number of steps
    is_complete: bool  # False: the ellipse left the window, and a larger window is needed


class _EllipsePixels(NamedTuple):
    """Buffers for an ellipse's pixels in each line of a window; see `_count_pixels`."""

    across: Counts  # weight decrement by a pixel's position on its line
    down: Counts  # weight decrement by line
    starts: Counts  # first pixel of each line
    stops: Counts  # end of each line, exclusive


def ellipse_counts(
    codes: Codes,
    corner: tuple[int, int],
    transposed: bool,
    ellipses: Array,
    kernel: Kernel,
    bins: Counts,
    n_bins: int,
) -> EllipseCounts:
    """Count bins in ellipses, pixel by pixel.

    Kernels: `isotropic` 1 - (dx² + dy²) / (Hx² + Hy²), above 0 on the rim (Nummiaro et al. 2003,
    equations 2 and 3); `epanechnikov` 1 - (dx / Hx)² - (dy / Hy)²; `uniform` 1.

    `codes` uint16 (height, width): bin of every pixel of a window that contains the ellipses' part
      of the image; shape (width, height) if `transposed`.
    `corner`: left and top of the window [pixels].
    `ellipses` float64 (n, 4): centre x, y and half axes Hx, Hy, above 0 [pixels].
    `bins` int64 (m,): requested bins, out of `n_bins`.
    """
    slots = np.zeros(n_bins, np.uint16)
    slots[bins] = np.arange(1, len(bins) + 1)
    left, top = corner
    if transposed:
        ellipses, left, top = ellipses[:, [1, 0, 3, 2]], top, left
    pixel_slots = _slots_of_pixels(codes, slots)
    return EllipseCounts(
        *_count_slots(
            pixel_slots,
            left,
            top,
            np.ascontiguousarray(ellipses),
            KERNELS.index(kernel),
            len(bins),
        )
    )


@njit(cache=True)
def _slots_of_pixels(codes: Codes, slots: Codes) -> Codes:
    """Return the index of each pixel in a short histogram of the requested bins; 0 for others."""
    places = np.empty(codes.shape, np.uint16)
    for row in range(codes.shape[0]):
        for column in range(codes.shape[1]):
            places[row, column] = slots[np.uintp(codes[row, column])]
    return places


@njit(cache=True)
def _count_slots(
    pixel_slots: Codes, left: int, top: int, ellipses: Array, kernel: int, n_asked: int
) -> tuple[Counts, Counts, Counts]:
    n = len(ellipses)
    counts = np.empty((n, n_asked), np.int64)
    totals, pixels = np.zeros(n, np.int64), np.zeros(n, np.int64)
    buffers, histograms = _buffers(pixel_slots), np.empty((4, n_asked + 1), np.int64)
    for i in range(n):
        x, y, half_x, half_y = ellipses[i, 0], ellipses[i, 1], ellipses[i, 2], ellipses[i, 3]
        fall_x, fall_y = _FULL / (half_x * half_x), _FULL / (half_y * half_y)
        if kernel == _ISOTROPIC:
            fall_x = fall_y = _FULL / (half_x * half_x + half_y * half_y)
        elif kernel == _UNIFORM:
            fall_x = fall_y = 0.0
        first, last, _ = _count_pixels(
            pixel_slots, x, y, half_x, half_y, fall_x, fall_y, left, top, buffers, histograms
        )
        for row in range(first, last):
            pixels[i] += buffers.stops[row] - buffers.starts[row]
        totals[i] = histograms.sum()
        for slot in range(n_asked):
            counts[i, slot] = (
                histograms[0, slot + 1]
                + histograms[1, slot + 1]
                + histograms[2, slot + 1]
                + histograms[3, slot + 1]
            )
    return counts, totals, pixels


@njit(cache=True)
def _buffers(codes: Codes) -> _EllipsePixels:
    lines, length = codes.shape
    return _EllipsePixels(
        np.empty(length, np.int64),
        np.empty(lines, np.int64),
        np.empty(lines, np.int64),
        np.empty(lines, np.int64),
    )


@njit(cache=True)
def _count_pixels(
    codes: Codes,
    x: float,
    y: float,
    half_x: float,
    half_y: float,
    fall_x: float,
    fall_y: float,
    left: int,
    top: int,
    pixels: _EllipsePixels,
    histograms: Counts,
) -> tuple[int, int, int]:
    """Fill `pixels` with an ellipse, and four `histograms` with the weights of its pixels.

    Pixels are added to the histograms in turn, so that an addition does not depend on the one
    before. Returns the ellipse's first line, end line and first column.
    """
    n_columns, n_rows = len(pixels.across), len(pixels.down)
    begin, end = _axis_range(x, half_x, left, n_columns)
    for column in range(begin, end):
        distance = column + left + 0.5 - x
        pixels.across[column] = int(fall_x * distance * distance)
    upper, lower = _axis_range(y, half_y, top, n_rows)
    for row in range(upper, lower):  # a separate loop lets the CPU overlap the square roots
        distance = row + top + 0.5 - y
        share = distance / half_y
        reach = half_x * np.sqrt(max(0.0, 1.0 - share * share))
        pixels.starts[row], pixels.stops[row] = _axis_range(x, reach, left, n_columns)
        pixels.down[row] = int(fall_y * distance * distance)
    histograms[:] = 0
    falls = pixels.across
    histogram_0, histogram_1 = histograms[0], histograms[1]
    histogram_2, histogram_3 = histograms[2], histograms[3]
    for row in range(upper, lower):
        line, start, stop = codes[row], pixels.starts[row], pixels.stops[row]
        maximum = _FULL - pixels.down[row]
        quads = start + (stop - start) // 4 * 4
        # Unsigned indices avoid the check for negative ones.
        for column in range(start, quads, 4):
            i, j = np.uintp(column), np.uintp(column + 1)
            k, m = np.uintp(column + 2), np.uintp(column + 3)
            histogram_0[np.uintp(line[i])] += maximum - falls[i]
            histogram_1[np.uintp(line[j])] += maximum - falls[j]
            histogram_2[np.uintp(line[k])] += maximum - falls[k]
            histogram_3[np.uintp(line[m])] += maximum - falls[m]
        for column in range(quads, stop):
            i = np.uintp(column)
            histogram_0[np.uintp(line[i])] += maximum - falls[i]
    return upper, lower, begin


@njit(cache=True)
def _axis_range(centre: float, reach: float, origin: int, size: int) -> tuple[int, int]:
    """Return first and end of the window's pixels with centres within reach on one axis."""
    first, last = np.ceil(centre - reach - 0.5), np.floor(centre + reach - 0.5) + 1.0
    first, last = max(first, float(origin)), min(last, float(origin + size))
    if not first < last:  # NaN also ends here
        return 0, 0
    return int(first) - origin, int(last) - origin


@njit(cache=True)
def bhattacharyya_coefficients(counts: Counts, totals: Counts, models: Array) -> Array:
    """Return Bhattacharyya coefficients Σ √(p q), float64 (n,), in [0, 1].

    `counts` int64 (n, m): unnormalised histograms p in the non-empty bins of the models.
    `totals` int64 (n,): sums of the complete histograms; if 0, the coefficient is 0.
    `models` float64 (1, m) or (n, m): normalised histograms q: one for all histograms p, or one for
    each.
    """
    values = np.zeros(len(counts))
    for i in range(len(counts)):
        if totals[i] > 0:
            model = models[i if len(models) > 1 else 0]
            summed = 0.0
            for j in range(counts.shape[1]):
                summed += np.sqrt(np.float64(counts[i, j]) * model[j])
            values[i] = min(summed / np.sqrt(np.float64(totals[i])), 1.0)
    return values


@njit(cache=True)
def mean_shift(
    window: CodeWindow,
    bins: Counts,
    model: Array,
    n_bins: int,
    ellipse: tuple[float, float, float, float],
    stop_distance: float,
    max_iterations: int,
    halving: bool,
) -> MeanShiftResult:
    """Move an ellipse to a local maximum of the similarity of its histogram p to the model q.

    p has the Epanechnikov kernel, whose profile has a constant derivative. So a step goes to the
    mean of the ellipse's pixels, weighted by √(q/p) of their bins (Comaniciu, Ramesh & Meer 2000,
    2003). The search stops after a step shorter than `stop_distance` [pixels]. With `halving`, a
    step that lowers the coefficient is halved until the coefficient does not fall. A halved step
    shorter than `stop_distance` is skipped.

    `window`: codes of the search window; the search ends if the ellipse leaves the window.
    `bins` int64 (m,): non-empty bins of the model, out of `n_bins`.
    `model` float64 (m,): normalised model histogram q.
    `ellipse`: initial centre x, y, and half axes, above 0 [pixels].
    """
    x, y, half_width, half_height = ellipse
    histograms, weights = np.empty((4, n_bins), np.int64), np.zeros(n_bins)
    pixels = _buffers(window.codes)
    complete, first, last, begin = _count(window, x, y, half_width, half_height, pixels, histograms)
    if not complete:
        return MeanShiftResult(x, y, 0.0, 0, False)
    coefficient = _weigh(histograms, bins, model, weights)
    iterations = 0
    while coefficient > 0.0 and iterations < max_iterations:
        iterations += 1
        new_x, new_y = _centroid(window, pixels, first, last, begin, weights)
        while True:
            complete, first, last, begin = _count(
                window, new_x, new_y, half_width, half_height, pixels, histograms
            )
            if not complete:
                return MeanShiftResult(x, y, 0.0, iterations, False)
            new_coefficient = _weigh(histograms, bins, model, weights)
            step = np.hypot(new_x - x, new_y - y)
            if not halving or new_coefficient >= coefficient:
                break
            if step < stop_distance:
                return MeanShiftResult(x, y, coefficient, iterations, True)
            new_x, new_y = (x + new_x) / 2, (y + new_y) / 2
        x, y, coefficient = new_x, new_y, new_coefficient
        if step < stop_distance:
            break
    return MeanShiftResult(x, y, coefficient, iterations, True)


@njit(cache=True)
def _count(
    window: CodeWindow,
    x: float,
    y: float,
    half_width: float,
    half_height: float,
    pixels: _EllipsePixels,
    histograms: Counts,
) -> tuple[bool, int, int, int]:
    """Fill pixels and histogram; return whether the window covers the ellipse, and its lines."""
    left, right = _axis_range(x, half_width, 0, window.width)
    top, bottom = _axis_range(y, half_height, 0, window.height)
    n_columns, n_rows = window.codes.shape
    empty = left == right or top == bottom
    wide_enough = window.left <= left and right <= window.left + n_columns
    complete = empty or (wide_enough and window.top <= top and bottom <= window.top + n_rows)
    first, last, begin = 0, 0, 0
    if complete:
        fall_x, fall_y = _FULL / (half_width * half_width), _FULL / (half_height * half_height)
        first, last, begin = _count_pixels(
            window.codes,
            y,
            x,
            half_height,
            half_width,
            fall_y,
            fall_x,
            window.top,
            window.left,
            pixels,
            histograms,
        )
    return complete, first, last, begin


@njit(cache=True)
def _weigh(histograms: Counts, bins: Counts, model: Array, weights: Array) -> float:
    """Fill the weights √(q/p) of the model's bins; return the coefficient Σ √(p q)."""
    total = np.float64(histograms.sum())
    if total == 0.0:
        return 0.0
    summed = 0.0
    for k in range(len(bins)):
        u = bins[k]
        p = (histograms[0, u] + histograms[1, u] + histograms[2, u] + histograms[3, u]) / total
        weights[u] = np.sqrt(model[k] / p) if p > 0.0 else 0.0
        summed += np.sqrt(p * model[k])
    return float(min(summed, 1.0))


@njit(cache=True)
def _centroid(
    window: CodeWindow, pixels: _EllipsePixels, first: int, last: int, begin: int, weights: Array
) -> tuple[float, float]:
    """Return the weighted mean x, y of an ellipse's pixels; at least one weight must be above 0."""
    total, total_x, total_y = 0.0, 0.0, 0.0
    for i in range(last - first):
        line = window.codes[first + i]
        in_column = 0.0
        for j in range(pixels.starts[first + i] - begin, pixels.stops[first + i] - begin):
            weight = weights[np.uintp(line[np.uintp(begin + j)])]
            in_column += weight
            total_y += weight * j
        total += in_column
        total_x += in_column * i
    return (
        total_x / total + (window.left + first) + 0.5,
        total_y / total + (window.top + begin) + 0.5,
    )
