"""Mean shift of an ellipse towards a model histogram (Comaniciu, Ramesh & Meer 2000, 2003).

Histograms are those of `trackers.histograms.ellipses` under the Epanechnikov kernel, to
the bit: their counts are whole numbers.

The kernels that call one another stand in this one file: Numba's cache notices a change of
a kernel's own file only.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Found", "Window", "mean_shift"]

_FULL = 65536  # weight at the centre


class Window(NamedTuple):
    """Codes of a window of an image.

    Attributes
    ----------
    codes : ndarray of uint16, shape (window's width, window's height)
        Bin of each pixel, by column.
    left, top : int
        The window's first column and row in the image.
    width, height : int
        Of the image, in pixels.
    """

    codes: NDArray[np.uint16]
    left: int
    top: int
    width: int
    height: int


class Found(NamedTuple):
    """Where mean shift came to rest.

    Attributes
    ----------
    x, y : float
        Centre, in pixels.
    coefficient : float
        Bhattacharyya coefficient there, in [0, 1]; 0 where no pixel has a bin of the model.
    iterations : int
        Steps taken.
    complete : bool
        Whether the window held all; where not, it ended early, and a larger one is needed.
    """

    x: float
    y: float
    coefficient: float
    iterations: int
    complete: bool


class _Ellipse(NamedTuple):
    """Pixels of an ellipse inside the image; column i has rows first[i] to last[i] - 1.

    Columns count from `left`, rows from `top`, and these from the window's first ones.
    """

    left: int
    top: int
    across: NDArray[np.int64]  # what a column's distance from the centre takes from the weight
    down: NDArray[np.int64]  # what a row's takes
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    complete: bool


@njit(cache=True)
def _axis(centre: float, half: float, size: int) -> tuple[int, NDArray[np.int64]]:
    """First pixel that an ellipse may have along an axis, and what each takes from the weight."""
    first = int(max(np.ceil(centre - half - 0.5), 0.0))
    end = int(min(np.floor(centre + half - 0.5) + 1.0, float(size)))
    taken = np.empty(max(end - first, 0), np.int64)
    fall = _FULL / (half * half)
    for i in range(len(taken)):
        distance = first + i + 0.5 - centre
        taken[i] = int(fall * distance * distance)
    return first, taken


@njit(cache=True)
def _ellipse(window: Window, x: float, y: float, half_width: float, half_height: float) -> _Ellipse:
    left, across = _axis(x, half_width, window.width)
    top, down = _axis(y, half_height, window.height)
    columns, rows = len(across), len(down)
    first, last = np.zeros(columns, np.int64), np.zeros(columns, np.int64)
    for i in range(columns):
        distance = (left + i + 0.5 - x) / half_width
        reach = half_height * np.sqrt(max(0.0, 1.0 - distance * distance))
        first[i] = max(int(np.ceil(y - reach - 0.5)) - top, 0)
        last[i] = max(min(int(np.floor(y + reach - 0.5)) + 1 - top, rows), first[i])
    left, top = left - window.left, top - window.top
    window_width, window_height = window.codes.shape
    complete = (
        columns == 0
        or rows == 0
        or (0 <= left <= window_width - columns and 0 <= top <= window_height - rows)
    )
    return _Ellipse(left, top, across, down, first, last, complete)


@njit(cache=True)
def _count(window: Window, ellipse: _Ellipse, counts: NDArray[np.int64]) -> None:
    """Fill in the histogram of an ellipse, in four parts, shape (4, n_bins)."""
    counts[:] = 0
    # Neighbours mostly are in the same bin: four histograms keep an addition from waiting
    # for the one before.
    one, two, three, four = counts[0], counts[1], counts[2], counts[3]
    for i in range(len(ellipse.across)):
        most, first, last = _FULL - ellipse.across[i], ellipse.first[i], ellipse.last[i]
        column = window.codes[ellipse.left + i, ellipse.top + first : ellipse.top + last]
        down = ellipse.down[first:last]
        quads = len(column) // 4 * 4
        for j in range(0, quads, 4):
            # Indices that can't be negative need no check for it.
            at, to, on, by = np.uintp(j), np.uintp(j + 1), np.uintp(j + 2), np.uintp(j + 3)
            one[np.uintp(column[at])] += most - down[at]
            two[np.uintp(column[to])] += most - down[to]
            three[np.uintp(column[on])] += most - down[on]
            four[np.uintp(column[by])] += most - down[by]
        for j in range(quads, len(column)):
            at = np.uintp(j)
            one[np.uintp(column[at])] += most - down[at]


@njit(cache=True)
def _weigh(
    counts: NDArray[np.int64],
    bins: NDArray[np.int64],
    model: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> float:
    """Fill in the weights √(q/p) of the model's bins; give the coefficient Σ √(p q)."""
    total = np.float64(counts.sum())
    if total == 0.0:
        return 0.0
    summed = 0.0
    for k in range(len(bins)):
        u = bins[k]
        p = (counts[0, u] + counts[1, u] + counts[2, u] + counts[3, u]) / total
        weights[u] = np.sqrt(model[k] / p) if p > 0.0 else 0.0
        summed += np.sqrt(p * model[k])
    return float(min(summed, 1.0))


@njit(cache=True)
def _centroid(
    window: Window, ellipse: _Ellipse, weights: NDArray[np.float64]
) -> tuple[float, float]:
    """Mean of an ellipse's pixels, each with the weight of its bin; not all weigh nothing."""
    total, total_x, total_y = 0.0, 0.0, 0.0
    for i in range(len(ellipse.across)):
        column = window.codes[ellipse.left + i]
        in_column = 0.0
        for j in range(ellipse.first[i], ellipse.last[i]):
            weight = weights[np.uintp(column[np.uintp(ellipse.top + j)])]
            in_column += weight
            total_y += weight * j
        total += in_column
        total_x += in_column * i
    return (
        total_x / total + (window.left + ellipse.left) + 0.5,
        total_y / total + (window.top + ellipse.top) + 0.5,
    )


@njit(cache=True)
def mean_shift(
    window: Window,
    bins: NDArray[np.int64],
    model: NDArray[np.float64],
    n_bins: int,
    ellipse: tuple[float, float, float, float],
    stop_distance: float,
    max_iterations: int,
    halving: bool,
) -> Found:
    """Shift an ellipse to where its histogram p resembles the model q most.

    A step goes to the mean of the ellipse's pixels, each with the weight √(q/p) of its bin,
    for the derivative of the Epanechnikov profile is constant.

    Parameters
    ----------
    window : Window
        Codes. Where an ellipse needs pixels of the image beyond them, the search ends.
    bins : ndarray of int64, shape (m,)
        Those in which the model has something.
    model : ndarray of float64, shape (m,)
        What it has there, normalised.
    n_bins : int
        Number of bins that there are.
    ellipse : tuple of float
        Centre x and y to start from, and half axes, above 0, in pixels.
    stop_distance : float
        A step shorter than this is the last one taken, in pixels.
    max_iterations : int
        Most steps taken.
    halving : bool
        Whether a step that lowers the coefficient is halved until it does not; one shorter
        than `stop_distance` is not taken then.
    """
    x, y, half_width, half_height = ellipse
    counts, weights = np.empty((4, n_bins), np.int64), np.zeros(n_bins)
    here = _ellipse(window, x, y, half_width, half_height)
    if not here.complete:
        return Found(x, y, 0.0, 0, False)
    _count(window, here, counts)
    coefficient = _weigh(counts, bins, model, weights)
    iterations = 0
    while coefficient > 0.0 and iterations < max_iterations:
        iterations += 1
        new_x, new_y = _centroid(window, here, weights)
        while True:
            here = _ellipse(window, new_x, new_y, half_width, half_height)
            if not here.complete:
                return Found(x, y, 0.0, iterations, False)
            _count(window, here, counts)
            found = _weigh(counts, bins, model, weights)
            step = np.hypot(new_x - x, new_y - y)
            if not halving or found >= coefficient:
                break
            if step < stop_distance:
                return Found(x, y, coefficient, iterations, True)
            new_x, new_y = (x + new_x) / 2, (y + new_y) / 2
        x, y, coefficient = new_x, new_y, found
        if step < stop_distance:
            break
    return Found(x, y, coefficient, iterations, True)
