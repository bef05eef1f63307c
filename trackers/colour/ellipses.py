"""Kernel-weighted counts of colour bins in upright ellipses, in integers.

A pixel belongs to an ellipse where its centre does. Its weight is 65536 less what its distances
from the centre along the two axes take away, each rounded down to a whole number: sums in any
order give the same bits.
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
    slots = np.full(n_bins, -1)
    slots[bins] = np.arange(len(bins))
    left, top = corner
    if transposed:
        ellipses, left, top = ellipses[:, [1, 0, 3, 2]], top, left
    return EllipseCounts(
        *_count(codes, left, top, ellipses, KERNELS.index(kernel), slots, len(bins))
    )


@njit(cache=True)
def _count(
    codes: NDArray[np.uint16],
    left: int,
    top: int,
    ellipses: NDArray[np.float64],
    kernel: int,
    slots: NDArray[np.int64],
    n_asked: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    n_rows, n_columns = codes.shape
    n, n_bins = len(ellipses), len(slots)
    counts = np.zeros((n, n_asked), np.int64)
    totals, pixels = np.zeros(n, np.int64), np.zeros(n, np.int64)
    taken = np.empty(n_columns, np.int64)
    # Neighbours mostly are in the same bin: four histograms keep an addition from waiting
    # for the one before.
    first, second = np.empty(n_bins, np.int64), np.empty(n_bins, np.int64)
    third, fourth = np.empty(n_bins, np.int64), np.empty(n_bins, np.int64)
    for i in range(n):
        x, y, half_x, half_y = ellipses[i]
        if not (abs(x) < 1e9 and abs(y) < 1e9 and half_x < 1e9 and half_y < 1e9):  # true of NaN
            continue
        fall_x, fall_y = _FULL / (half_x * half_x), _FULL / (half_y * half_y)
        if kernel == _ISOTROPIC:
            fall_x = fall_y = _FULL / (half_x * half_x + half_y * half_y)
        elif kernel == _UNIFORM:
            fall_x = fall_y = 0.0
        begin = max(int(np.ceil(x - half_x - 0.5)) - left, 0)
        end = min(int(np.floor(x + half_x - 0.5)) + 1 - left, n_columns)
        for column in range(begin, end):
            distance = column + left + 0.5 - x
            taken[column] = int(fall_x * distance * distance)
        upper = max(int(np.ceil(y - half_y - 0.5)) - top, 0)
        lower = min(int(np.floor(y + half_y - 0.5)) + 1 - top, n_rows)
        first[:], second[:], third[:], fourth[:] = 0, 0, 0, 0
        for row in range(upper, lower):
            distance = row + top + 0.5 - y
            most = _FULL - int(fall_y * distance * distance)
            across = distance / half_y
            reach = half_x * np.sqrt(max(0.0, 1.0 - across * across))
            start = max(int(np.ceil(x - reach - 0.5)) - left, 0)
            stop = min(int(np.floor(x + reach - 0.5)) + 1 - left, n_columns)
            if stop <= start:
                continue
            pixels[i] += stop - start
            quads = start + (stop - start) // 4 * 4
            for column in range(start, quads, 4):
                # Indices that can't be negative need no check for it.
                at, to, on, by = (
                    np.uintp(column),
                    np.uintp(column + 1),
                    np.uintp(column + 2),
                    np.uintp(column + 3),
                )
                first[np.uintp(codes[row, at])] += most - taken[at]
                second[np.uintp(codes[row, to])] += most - taken[to]
                third[np.uintp(codes[row, on])] += most - taken[on]
                fourth[np.uintp(codes[row, by])] += most - taken[by]
            for column in range(quads, stop):
                at = np.uintp(column)
                first[np.uintp(codes[row, at])] += most - taken[at]
        for code in range(n_bins):
            summed = first[code] + second[code] + third[code] + fourth[code]
            totals[i] += summed
            if slots[code] >= 0:
                counts[i, slots[code]] = summed
    return counts, totals, pixels


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
