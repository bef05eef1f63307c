"""Kernel-weighted counts of colour bins in upright ellipses, in integers.

A pixel belongs to an ellipse where its centre does. Its weight is 65536 less what its distances
from the centre along the two axes take away, each rounded down to a whole number: sums in any
order give the same bits.

Mean shift counts one ellipse again and again, and asks its pixels back: it has a kernel of its
own, in `trackers.histograms.shifting`, with the same weights to the bit.
"""

from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["KERNELS", "EllipseCounts", "Kernel", "coefficients", "ellipse_counts"]

Kernel: TypeAlias = Literal["isotropic", "epanechnikov", "uniform"]
KERNELS: tuple[Kernel, ...] = ("isotropic", "epanechnikov", "uniform")
_ISOTROPIC, _UNIFORM = 0, 2

_FULL = 65536  # weight at the centre


class EllipseCounts(NamedTuple):
    """What is counted in ellipses.

    Attributes
    ----------
    counts : ndarray of int64, shape (n, m)
        Sum of the weights of the pixels in each of the bins asked for.
    totals : ndarray of int64, shape (n,)
        Sum of the weights of all pixels.
    pixels : ndarray of int64, shape (n,)
        Pixels of each ellipse that are inside the image.
    """

    counts: NDArray[np.int64]
    totals: NDArray[np.int64]
    pixels: NDArray[np.int64]


def ellipse_counts(
    codes: NDArray[np.uint16],
    corner: tuple[int, int],
    transposed: bool,
    ellipses: NDArray[np.float64],
    kernel: Kernel,
    bins: NDArray[np.int64],
    n_bins: int,
) -> EllipseCounts:
    """Count bins in ellipses, pixel by pixel.

    Parameters
    ----------
    codes : ndarray of uint16, shape (height, width), or (width, height) where transposed
        Bin of every pixel of a window of the image, or of all of it.
    corner : tuple of int
        Left and top of the window [pixels]; it holds all that is inside the image.
    transposed : bool
        Whether `codes` lie by column.
    ellipses : ndarray of float64, shape (n, 4)
        Centre x and y and half axes Hx and Hy, in pixels; half axes above 0.
    kernel : {'isotropic', 'epanechnikov', 'uniform'}
        What a weight falls with. 'isotropic': 1 - (dx² + dy²) / (Hx² + Hy²) (Nummiaro et al.
        2003, equations 2 and 3), which stays above 0 on the rim. 'epanechnikov':
        1 - (dx / Hx)² - (dy / Hy)². 'uniform': not at all.
    bins : ndarray of int64, shape (m,)
        The bins asked for.
    n_bins : int
        Number of bins that there are.
    """
    slots = np.zeros(n_bins, np.uint16)
    slots[bins] = np.arange(1, len(bins) + 1)
    left, top = corner
    if transposed:
        ellipses, left, top = ellipses[:, [1, 0, 3, 2]], top, left
    places = _placed(codes, slots)
    counted = _count(places, left, top, ellipses, KERNELS.index(kernel), len(bins))
    return EllipseCounts(*counted)


@njit(cache=True)
def _placed(codes: NDArray[np.uint16], slots: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Slot of every pixel: 0 for what is not asked for.

    Histograms are emptied and added up for every ellipse, so they had better be short.
    """
    places = np.empty(codes.shape, np.uint16)
    for row in range(codes.shape[0]):
        for column in range(codes.shape[1]):
            places[row, column] = slots[np.uintp(codes[row, column])]
    return places


@njit(cache=True)
def _count(
    places: NDArray[np.uint16],
    left: int,
    top: int,
    ellipses: NDArray[np.float64],
    kernel: int,
    n_asked: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    n_rows, n_columns = places.shape
    n = len(ellipses)
    counts = np.empty((n, n_asked), np.int64)
    totals, pixels = np.zeros(n, np.int64), np.zeros(n, np.int64)
    taken = np.empty(n_columns, np.int64)
    starts, stops = np.empty(n_rows, np.int64), np.empty(n_rows, np.int64)
    # Neighbours mostly are in the same bin: four histograms keep an addition from waiting
    # for the one before.
    first, second = np.empty(n_asked + 1, np.int64), np.empty(n_asked + 1, np.int64)
    third, fourth = np.empty(n_asked + 1, np.int64), np.empty(n_asked + 1, np.int64)
    for i in range(n):
        first[:], second[:], third[:], fourth[:] = 0, 0, 0, 0
        x, y, half_x, half_y = ellipses[i]
        fall_x, fall_y = _FULL / (half_x * half_x), _FULL / (half_y * half_y)
        if kernel == _ISOTROPIC:
            fall_x = fall_y = _FULL / (half_x * half_x + half_y * half_y)
        elif kernel == _UNIFORM:
            fall_x = fall_y = 0.0
        begin, end = _inside(x, half_x, left, n_columns)
        for column in range(begin, end):
            distance = column + left + 0.5 - x
            taken[column] = int(fall_x * distance * distance)
        upper, lower = _inside(y, half_y, top, n_rows)
        for row in range(upper, lower):  # in a loop of its own the square roots overlap
            across = (row + top + 0.5 - y) / half_y
            reach = half_x * np.sqrt(max(0.0, 1.0 - across * across))
            starts[row], stops[row] = _inside(x, reach, left, n_columns)
        for row in range(upper, lower):
            distance = row + top + 0.5 - y
            most = _FULL - int(fall_y * distance * distance)
            start, stop = starts[row], stops[row]
            pixels[i] += stop - start
            line = places[row]
            quads = start + (stop - start) // 4 * 4
            for column in range(start, quads, 4):
                # Indices that can't be negative need no check for it.
                at, to = np.uintp(column), np.uintp(column + 1)
                on, by = np.uintp(column + 2), np.uintp(column + 3)
                first[np.uintp(line[at])] += most - taken[at]
                second[np.uintp(line[to])] += most - taken[to]
                third[np.uintp(line[on])] += most - taken[on]
                fourth[np.uintp(line[by])] += most - taken[by]
            for column in range(quads, stop):
                at = np.uintp(column)
                first[np.uintp(line[at])] += most - taken[at]
        totals[i] = first[0] + second[0] + third[0] + fourth[0]
        for slot in range(n_asked):
            found = first[slot + 1] + second[slot + 1] + third[slot + 1] + fourth[slot + 1]
            counts[i, slot] = found
            totals[i] += found
    return counts, totals, pixels


@njit(cache=True)
def _inside(centre: float, reach: float, origin: int, size: int) -> tuple[int, int]:
    """Pixels of a window whose centres are within reach, from the first to after the last."""
    first, last = np.ceil(centre - reach - 0.5), np.floor(centre + reach - 0.5) + 1.0
    first, last = max(first, float(origin)), min(last, float(origin + size))
    if not first < last:  # true of NaN
        return 0, 0
    return int(first) - origin, int(last) - origin


@njit(cache=True)
def coefficients(
    counts: NDArray[np.int64], totals: NDArray[np.int64], models: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Bhattacharyya coefficients Σ √(p q) of histograms and models, in [0, 1].

    Parameters
    ----------
    counts : ndarray of int64, shape (n, m)
        One histogram p a row, unnormalised, of the bins in which the models have something.
    totals : ndarray of int64, shape (n,)
        Sums of the whole histograms; where it is 0, the coefficient is.
    models : ndarray of float64, shape (1, m) or (n, m)
        Normalised histograms q: one for all, or one for each.
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
