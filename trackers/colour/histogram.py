"""Exact counts of colour bins in rectangles, two ways, and distances between them.

Both ways give the same integers: `direct_counts` visits every pixel of every region,
`integral_histogram` every pixel once, after which a region costs four look-ups a bin.

The kernels that call one another stand in this one file: Numba's cache notices a change of
a kernel's own file only.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.interface import Image

__all__ = [
    "LARGEST_REGION",
    "IntegralHistogram",
    "bhattacharyya_distances",
    "direct_counts",
    "integral_counts",
    "integral_histogram",
    "looked_up",
]

LARGEST_REGION = 65535  # pixels that a region may have for sums modulo 65536 to be exact


class IntegralHistogram(NamedTuple):
    """Counts of bins in every rectangle that begins at the left top corner.

    Attributes
    ----------
    sums : ndarray of uint16, shape (height + 1, width + 1, slots)
        Counts modulo 65536 above and to the left of a pixel corner; slot 0 holds what was
        not asked for.
    slots : ndarray of int64, shape (bins,)
        Where a bin is counted; 0 where it is not.
    """

    sums: NDArray[np.uint16]
    slots: NDArray[np.int64]


@njit(cache=True)
def looked_up(image: Image, table: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """`table[blue, green, red]` of every pixel, shape (height, width)."""
    height, width, _ = image.shape
    found = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it: a third of the time.
            blue = np.uintp(image[row, column, 0])
            green = np.uintp(image[row, column, 1])
            red = np.uintp(image[row, column, 2])
            found[row, column] = table[blue, green, red]
    return found


@njit(cache=True)
def _slots(bins: NDArray[np.int64], n_bins: int) -> NDArray[np.int64]:
    """Slot of each bin: 1, 2, … in the order of `bins`, 0 for the others."""
    slots = np.zeros(n_bins, np.int64)
    for slot, chosen in enumerate(bins):
        slots[chosen] = slot + 1
    return slots


@njit(cache=True)
def integral_histogram(
    codes: NDArray[np.uint16], votes: NDArray[np.uint8], bins: NDArray[np.int64], n_bins: int
) -> IntegralHistogram:
    """Integral histogram of an image or a window of one (Porikli 2005).

    Parameters
    ----------
    codes : ndarray of uint16, shape (height, width)
        Code of every pixel.
    votes : ndarray of uint8, shape (codes, votes a pixel)
        Bins that each code votes in.
    bins : ndarray of int64, shape (m,)
        The bins to count; time and memory grow with their number.
    n_bins : int
        Number of bins that there are.
    """
    height, width = codes.shape
    n_slots = len(bins) + 1
    slots = _slots(bins, n_bins)
    sums = np.empty((height + 1, width + 1, n_slots), np.uint16)
    sums[0] = 0
    # Counts of one column down to the row. All of a row are brought up to date before any is
    # added up: a sum that waits for a count just written costs more than the sum.
    columns = np.zeros((width, n_slots), np.uint16)
    for row in range(height):
        for column in range(width):
            code = np.uintp(codes[row, column])
            for vote in range(votes.shape[1]):
                columns[column, np.uintp(slots[np.uintp(votes[code, vote])])] += np.uint16(1)
        sums[row + 1, 0] = 0
        for column in range(width):
            for slot in range(n_slots):
                sums[row + 1, column + 1, slot] = (
                    sums[row + 1, column, slot] + columns[column, slot]
                )
    return IntegralHistogram(sums, slots)


@njit(cache=True)
def integral_counts(
    histogram: IntegralHistogram, regions: NDArray[np.int64], bins: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Counts of `bins` in regions; see `direct_counts`, whose result it gives.

    Regions hold at most `LARGEST_REGION` pixels; a bin that `histogram` does not have was
    nowhere in the image.
    """
    sums, slots = histogram
    counts = np.zeros((len(regions), len(bins)), np.int32)
    for i in range(len(regions)):
        left, top, right, bottom = regions[i]
        for j in range(len(bins)):
            slot = slots[bins[j]]
            if slot > 0:
                inside = np.int64(sums[bottom, right, slot]) - np.int64(sums[top, right, slot])
                outside = np.int64(sums[bottom, left, slot]) - np.int64(sums[top, left, slot])
                counts[i, j] = (inside - outside) & 0xFFFF
    return counts


@njit(cache=True)
def direct_counts(
    codes: NDArray[np.uint16],
    votes: NDArray[np.uint8],
    regions: NDArray[np.int64],
    bins: NDArray[np.int64],
    n_bins: int,
) -> NDArray[np.int32]:
    """Counts of bins in regions, pixel by pixel.

    Parameters
    ----------
    codes : ndarray of uint16, shape (height, width)
        Code of every pixel.
    votes : ndarray of uint8, shape (codes, votes a pixel)
        Bins that each code votes in.
    regions : ndarray of int64, shape (n, 4)
        `[left, top, right, bottom]` in whole pixels, right and bottom exclusive, inside.
    bins : ndarray of int64, shape (m,)
        The bins asked for.
    n_bins : int
        Number of bins that there are.

    Returns
    -------
    ndarray of int32, shape (n, m)
        Votes in each.
    """
    n_codes, n_votes = votes.shape
    slots = _slots(bins, n_bins)
    counts = np.zeros((len(regions), len(bins)), np.int32)
    # Neighbours mostly have the same code: four histograms keep an increment from waiting
    # for the one before.
    first, second = np.empty(n_codes, np.int32), np.empty(n_codes, np.int32)
    third, fourth = np.empty(n_codes, np.int32), np.empty(n_codes, np.int32)
    summed = np.empty(len(bins) + 1, np.int32)
    for i in range(len(regions)):
        left, top, right, bottom = regions[i]
        first[:], second[:], third[:], fourth[:] = 0, 0, 0, 0
        quads = left + (right - left) // 4 * 4
        for row in range(top, bottom):
            for column in range(left, quads, 4):
                first[np.uintp(codes[row, np.uintp(column)])] += 1
                second[np.uintp(codes[row, np.uintp(column + 1)])] += 1
                third[np.uintp(codes[row, np.uintp(column + 2)])] += 1
                fourth[np.uintp(codes[row, np.uintp(column + 3)])] += 1
            for column in range(quads, right):
                first[np.uintp(codes[row, np.uintp(column)])] += 1
        summed[:] = 0
        for code in range(n_codes):
            pixels = first[code] + second[code] + third[code] + fourth[code]
            for vote in range(n_votes):
                summed[slots[votes[code, vote]]] += pixels
        counts[i] = summed[1:]
    return counts


@njit(cache=True)
def bhattacharyya_distances(
    counts: NDArray[np.int32],
    totals: NDArray[np.int64],
    reference: NDArray[np.int32],
    reference_total: int,
) -> NDArray[np.float64]:
    """Distances d = √(1 - Σ √(p q)) of normalised histograms, in [0, 1].

    Counts go in unnormalised: equal proportions have a distance of exactly 0 that way.

    Parameters
    ----------
    counts : ndarray of int32, shape (n, m)
        One histogram a row, of the bins in which the reference has counts.
    totals : ndarray of int64, shape (n,)
        Sums of the whole histograms; where it is 0, d is 1.
    reference : ndarray of int32, shape (m,)
        Counts of q.
    reference_total : int
        Their sum.
    """
    distances = np.ones(len(counts), np.float64)
    for i in range(len(counts)):
        if totals[i] > 0:
            summed = 0.0
            for j in range(len(reference)):
                summed += np.sqrt(np.float64(counts[i, j]) * np.float64(reference[j]))
            coefficient = summed / np.sqrt(np.float64(totals[i]) * np.float64(reference_total))
            distances[i] = np.sqrt(max(0.0, 1.0 - coefficient))
    return distances
