"""Kernel-weighted counts of colour bins in upright ellipses, and mean shift of one towards a model.

A pixel belongs to an ellipse where its centre does. Its weight is 65536 less what its distances
from the centre along the two axes take away, each rounded down to a whole number: sums in any order
give the same bits.
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
    """What is counted in n ellipses."""

    counts: Counts  # (n, m): sum of the weights of the pixels in each of the bins asked for
    totals: Counts  # (n,): sum of the weights of all pixels
    pixels: Counts  # (n,): pixels of each that are inside the image


class CodeWindow(NamedTuple):
    """Codes of a window of an image."""

    codes: Codes  # (window's width, window's height): bin of each pixel, by column
    left: int  # the window's first column and row in the image
    top: int
    width: int  # of the image [pixels]
    height: int


class MeanShiftResult(NamedTuple):
    """Where mean shift came to rest."""

    x: float  # centre [pixels]
    y: float
    coefficient: float  # Bhattacharyya's, in [0, 1]; 0 where no pixel has a bin of the model
    iterations: int  # steps taken
    complete: bool  # whether the window held all; where not, a larger one is needed


class _Pixels(NamedTuple):
    """Buffers for the pixels of an ellipse in lines of a window; see `_lay_out`."""

    across: Counts  # what a pixel's distance from the centre along its line takes from the weight
    down: Counts  # what the line's distance takes
    starts: Counts  # pixels of each line, from the first to after the last
    stops: Counts


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

    `codes` (height, width), or (width, height) where `transposed`, hold the bin of every pixel of a
    window of the image, or of all of it; `corner` is the window's left and top [pixels], and it
    holds all that is inside the image. `ellipses` (n, 4) are centre x and y and half axes Hx and
    Hy, above 0 [pixels]. `bins` (m,) are those asked for, of `n_bins` that there are.

    A weight falls with the distance: isotropic 1 - (dx² + dy²) / (Hx² + Hy²) (Nummiaro et al. 2003,
    equations 2 and 3), which stays above 0 on the rim; epanechnikov 1 - (dx / Hx)² - (dy / Hy)²;
    uniform, not at all.
    """
    slots = np.zeros(n_bins, np.uint16)
    slots[bins] = np.arange(1, len(bins) + 1)
    left, top = corner
    if transposed:
        ellipses, left, top = ellipses[:, [1, 0, 3, 2]], top, left
    places = _placed(codes, slots)
    return EllipseCounts(*_counted(places, left, top, ellipses, KERNELS.index(kernel), len(bins)))


@njit(cache=True)
def _placed(codes: Codes, slots: Codes) -> Codes:
    """Slot of every pixel, 0 for what is not asked for: short histograms are soon added up."""
    places = np.empty(codes.shape, np.uint16)
    for row in range(codes.shape[0]):
        for column in range(codes.shape[1]):
            places[row, column] = slots[np.uintp(codes[row, column])]
    return places


@njit(cache=True)
def _counted(
    places: Codes, left: int, top: int, ellipses: Array, kernel: int, n_asked: int
) -> tuple[Counts, Counts, Counts]:
    n = len(ellipses)
    counts = np.empty((n, n_asked), np.int64)
    totals, pixels = np.zeros(n, np.int64), np.zeros(n, np.int64)
    buffers, parts = _buffers(places), np.empty((4, n_asked + 1), np.int64)
    across, down, starts, stops = buffers
    rows = parts[0], parts[1], parts[2], parts[3]
    for i in range(n):
        parts[:] = 0
        x, y, half_x, half_y = ellipses[i]
        fall_x, fall_y = _FULL / (half_x * half_x), _FULL / (half_y * half_y)
        if kernel == _ISOTROPIC:
            fall_x = fall_y = _FULL / (half_x * half_x + half_y * half_y)
        elif kernel == _UNIFORM:
            fall_x = fall_y = 0.0
        first, last, _ = _lay_out(x, y, half_x, half_y, fall_x, fall_y, left, top, buffers)
        for row in range(first, last):
            start, stop = starts[row], stops[row]
            pixels[i] += stop - start
            _add(places[row], start, stop, _FULL - down[row], across, rows)
        totals[i] = parts.sum()
        for slot in range(n_asked):
            at = slot + 1
            counts[i, slot] = parts[0, at] + parts[1, at] + parts[2, at] + parts[3, at]
    return counts, totals, pixels


@njit(cache=True)
def _buffers(codes: Codes) -> _Pixels:
    lines, length = codes.shape
    return _Pixels(
        np.empty(length, np.int64),
        np.empty(lines, np.int64),
        np.empty(lines, np.int64),
        np.empty(lines, np.int64),
    )


@njit(cache=True)
def _lay_out(
    x: float,
    y: float,
    half_x: float,
    half_y: float,
    fall_x: float,
    fall_y: float,
    left: int,
    top: int,
    pixels: _Pixels,
) -> tuple[int, int, int]:
    """Fill in the pixels inside; return the first line, that after the last, the first column."""
    n_columns, n_rows = len(pixels.across), len(pixels.down)
    begin, end = _inside(x, half_x, left, n_columns)
    for column in range(begin, end):
        distance = column + left + 0.5 - x
        pixels.across[column] = int(fall_x * distance * distance)
    upper, lower = _inside(y, half_y, top, n_rows)
    for row in range(upper, lower):  # in a loop of its own the square roots overlap
        distance = row + top + 0.5 - y
        share = distance / half_y
        reach = half_x * np.sqrt(max(0.0, 1.0 - share * share))
        pixels.starts[row], pixels.stops[row] = _inside(x, reach, left, n_columns)
        pixels.down[row] = int(fall_y * distance * distance)
    return upper, lower, begin


@njit(cache=True)
def _inside(centre: float, reach: float, origin: int, size: int) -> tuple[int, int]:
    """Pixels of a window whose centres are within reach, from the first to after the last."""
    first, last = np.ceil(centre - reach - 0.5), np.floor(centre + reach - 0.5) + 1.0
    first, last = max(first, float(origin)), min(last, float(origin + size))
    if not first < last:  # true of NaN
        return 0, 0
    return int(first) - origin, int(last) - origin


@njit(cache=True, inline="always")
def _add(
    line: Codes, start: int, stop: int, most: int, taken: Counts, parts: tuple[Counts, ...]
) -> None:
    """Add weights `most` - `taken` to four histograms in turn: no addition waits for another."""
    one, two, three, four = parts
    quads = start + (stop - start) // 4 * 4
    # Indices that can't be negative need no check for it.
    for column in range(start, quads, 4):
        at, to = np.uintp(column), np.uintp(column + 1)
        on, by = np.uintp(column + 2), np.uintp(column + 3)
        one[np.uintp(line[at])] += most - taken[at]
        two[np.uintp(line[to])] += most - taken[to]
        three[np.uintp(line[on])] += most - taken[on]
        four[np.uintp(line[by])] += most - taken[by]
    for column in range(quads, stop):
        at = np.uintp(column)
        one[np.uintp(line[at])] += most - taken[at]


@njit(cache=True)
def bhattacharyya_coefficients(counts: Counts, totals: Counts, models: Array) -> Array:
    """Bhattacharyya coefficients Σ √(p q) of histograms and models, shape (n,), in [0, 1].

    `counts` (n, m) are histograms p, unnormalised, of the bins in which the models have something;
    `totals` (n,) the sums of the whole histograms: where one is 0, the coefficient is. `models` are
    normalised histograms q: (1, m), one for all, or (n, m), one for each.
    """
    found = np.zeros(len(counts))
    for i in range(len(counts)):
        if totals[i] > 0:
            model = models[i if len(models) > 1 else 0]
            summed = 0.0
            for j in range(counts.shape[1]):
                summed += np.sqrt(np.float64(counts[i, j]) * model[j])
            found[i] = min(summed / np.sqrt(np.float64(totals[i])), 1.0)
    return found


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
    """Shift an ellipse to where its histogram p resembles the model q most.

    p is taken under the Epanechnikov kernel. A step goes to the mean of the ellipse's pixels, each
    with the weight √(q/p) of its bin, for the derivative of that kernel's profile is constant
    (Comaniciu, Ramesh & Meer 2000, 2003). A step shorter than `stop_distance` [pixels] is the last
    one taken; with `halving`, one that lowers the coefficient is halved until it does not, and one
    so short is not taken then.

    `bins` (m,) are those of `n_bins` in which the model (m,), normalised, has something; `ellipse`
    is centre x and y to start from, and half axes, above 0 [pixels]. Where an ellipse needs pixels
    of the image beyond those of the window, the search ends.
    """
    x, y, half_width, half_height = ellipse
    parts, weights = np.empty((4, n_bins), np.int64), np.zeros(n_bins)
    pixels = _buffers(window.codes)
    complete, first, last, begin = _count(window, x, y, half_width, half_height, pixels, parts)
    if not complete:
        return MeanShiftResult(x, y, 0.0, 0, False)
    coefficient = _weigh(parts, bins, model, weights)
    iterations = 0
    while coefficient > 0.0 and iterations < max_iterations:
        iterations += 1
        new_x, new_y = _centroid(window, pixels, first, last, begin, weights)
        while True:
            complete, first, last, begin = _count(
                window, new_x, new_y, half_width, half_height, pixels, parts
            )
            if not complete:
                return MeanShiftResult(x, y, 0.0, iterations, False)
            found = _weigh(parts, bins, model, weights)
            step = np.hypot(new_x - x, new_y - y)
            if not halving or found >= coefficient:
                break
            if step < stop_distance:
                return MeanShiftResult(x, y, coefficient, iterations, True)
            new_x, new_y = (x + new_x) / 2, (y + new_y) / 2
        x, y, coefficient = new_x, new_y, found
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
    pixels: _Pixels,
    parts: Counts,
) -> tuple[bool, int, int, int]:
    """Fill in an ellipse's pixels and histogram; whether the window has all, and `_lay_out`'s."""
    left, right = _inside(x, half_width, 0, window.width)
    top, bottom = _inside(y, half_height, 0, window.height)
    n_columns, n_rows = window.codes.shape
    empty = left == right or top == bottom
    wide_enough = window.left <= left and right <= window.left + n_columns
    complete = empty or (wide_enough and window.top <= top and bottom <= window.top + n_rows)
    first, last, begin = 0, 0, 0
    if complete:
        parts[:] = 0
        fall_x, fall_y = _FULL / (half_width * half_width), _FULL / (half_height * half_height)
        first, last, begin = _lay_out(
            y, x, half_height, half_width, fall_y, fall_x, window.top, window.left, pixels
        )
        rows = parts[0], parts[1], parts[2], parts[3]
        across, down, starts, stops = pixels
        for column in range(first, last):
            start, stop = starts[column], stops[column]
            _add(window.codes[column], start, stop, _FULL - down[column], across, rows)
    return complete, first, last, begin


@njit(cache=True)
def _weigh(parts: Counts, bins: Counts, model: Array, weights: Array) -> float:
    """Fill in the weights √(q/p) of the model's bins; give the coefficient Σ √(p q)."""
    total = np.float64(parts.sum())
    if total == 0.0:
        return 0.0
    summed = 0.0
    for k in range(len(bins)):
        u = bins[k]
        p = (parts[0, u] + parts[1, u] + parts[2, u] + parts[3, u]) / total
        weights[u] = np.sqrt(model[k] / p) if p > 0.0 else 0.0
        summed += np.sqrt(p * model[k])
    return float(min(summed, 1.0))


@njit(cache=True)
def _centroid(
    window: CodeWindow, pixels: _Pixels, first: int, last: int, begin: int, weights: Array
) -> tuple[float, float]:
    """Mean of an ellipse's pixels, each with the weight of its bin; not all weigh nothing."""
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
