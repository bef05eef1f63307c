"""Counts of colour bins in rectangles, by two methods, and histogram distances.

Both methods return the same integers. `direct_counts` reads every pixel of every region.
`integral_histogram` reads every pixel of the frame once; a region then needs four look-ups per bin.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Codes, Ints

Votes: TypeAlias = NDArray[np.uint8]
Counts: TypeAlias = NDArray[np.int32]
Words: TypeAlias = NDArray[np.uint64]


class Regions(NamedTuple):
    """Rectangles split into parts from top to bottom, and their bounding window.

    Bounds are `[left, top, right, bottom]` in whole pixels inside the image, right and bottom
    exclusive. All bounds are 0 for a rectangle that is mostly outside the image.
    """

    bounds: Ints  # (parts, n, 4)
    pixels: Ints  # (parts, n): number of pixels
    left: int
    top: int
    right: int
    bottom: int


@njit(cache=True)
def pixel_regions(
    states: Array,
    aspect: float,
    n_parts: int,
    image_width: int,
    image_height: int,
    least_share: float,
    least_pixels: int,
) -> Regions:
    """Return the rectangles of states, clipped to the image and split into parts of equal height.

    `states` (n, 3): centre x, y [pixels] and area [square pixels]. `aspect`: width / height. The
    boundary of the two parts is the row ⌊(top + bottom) / 2⌋. A rectangle is empty if its part in
    the image is below `least_share` or `least_pixels`.
    """
    n = len(states)
    bounds = np.zeros((n_parts, n, 4), np.int64)
    pixels = np.zeros((n_parts, n), np.int64)
    window_left, window_top, window_right, window_bottom = image_width, image_height, 0, 0
    for i in range(n):
        x, y, area = states[i, 0], states[i, 1], states[i, 2]
        width = np.sqrt(area * aspect)
        height = area / width
        left, right = np.floor(x - width / 2 + 0.5), np.floor(x + width / 2 + 0.5)
        top, bottom = np.floor(y - height / 2 + 0.5), np.floor(y + height / 2 + 0.5)
        n_pixels = (right - left) * (bottom - top)
        left, right = max(left, 0.0), min(right, float(image_width))
        top, bottom = max(top, 0.0), min(bottom, float(image_height))
        inside = max(right - left, 0.0) * max(bottom - top, 0.0)
        if not (inside >= least_pixels and inside >= least_share * n_pixels):  # NaN also ends here
            continue
        first, last = int(left), int(right)
        start, stop = int(top), int(bottom)
        for part_index in range(n_parts):
            begin = start + part_index * (stop - start) // n_parts
            end = start + (part_index + 1) * (stop - start) // n_parts
            bounds[part_index, i, 0], bounds[part_index, i, 1] = first, begin
            bounds[part_index, i, 2], bounds[part_index, i, 3] = last, end
            pixels[part_index, i] = (last - first) * (end - begin)
        window_left, window_right = min(window_left, first), max(window_right, last)
        window_top, window_bottom = min(window_top, start), max(window_bottom, stop)
    return Regions(
        bounds,
        pixels,
        window_left,
        window_top,
        max(window_right, window_left),
        max(window_bottom, window_top),
    )


_LARGEST_BAND = 65535  # maximum number of pixels of a region that 16-bit counts can hold


class IntegralHistogram(NamedTuple):
    """Counts of bins in every rectangle that starts at the top left corner.

    A word of 64 bits holds four counts of 16 bits. An overflowing count carries into the next one,
    but sums and differences of words stay exact modulo 2⁶⁴. The word of a region is correct if each
    of its four counts is below 65536.
    """

    sums: Words  # (height + 1, words, width + 1): above and left of a pixel corner
    slots: Ints  # (bins,): where each bin is counted, 4 · word + quarter; -1 if it is not


def integral_histogram(codes: Codes, votes: Votes, bins: Ints, n_bins: int) -> IntegralHistogram:
    """Return the integral histogram (Porikli 2005); parameters as in `direct_counts`."""
    height, width = codes.shape
    slots = np.full(n_bins, -1)
    slots[bins] = np.arange(len(bins))
    # NumPy requests huge pages for large arrays; an array allocated in the kernel is slower.
    sums = np.empty((height + 1, (len(bins) + 3) // 4, width + 1), np.uint64)
    _sum_up(codes, votes, slots, sums)
    return IntegralHistogram(sums, slots)


@njit(cache=True)
def _sum_up(codes: Codes, votes: Votes, slots: Ints, sums: Words) -> None:
    """Fill the sums of an integral histogram."""
    height, width = codes.shape
    n_words = sums.shape[1]
    added = np.zeros((n_words, len(votes)), np.uint64)  # increment of a word by a pixel, by code
    for code in range(len(votes)):
        for vote in range(votes.shape[1]):
            slot = slots[votes[code, vote]]
            if slot >= 0:
                added[slot // 4, code] += np.uint64(1) << np.uint64(16 * (slot % 4))
    sums[0] = 0
    for row in range(height):
        for word in range(n_words):
            sums[row + 1, word, 0] = 0
            in_row = np.uint64(0)
            for column in range(width):
                in_row += added[word, np.uintp(codes[row, column])]
                sums[row + 1, word, column + 1] = sums[row, word, column + 1] + in_row


@njit(cache=True)
def integral_counts(sums: Words, slots: Ints, regions: Ints, bins: Ints) -> Counts:
    """Count as `direct_counts` does, in bands of at most 65535 pixels, as counts have 16 bits."""
    counts = np.zeros((len(regions), len(bins)), np.int32)
    for i in range(len(regions)):
        left, top, right, bottom = regions[i, 0], regions[i, 1], regions[i, 2], regions[i, 3]
        rows = max(_LARGEST_BAND // max(right - left, 1), 1)
        for start in range(top, bottom, rows):
            stop = min(start + rows, bottom)
            for j in range(len(bins)):
                slot = slots[bins[j]]
                if slot >= 0:
                    word, shift = slot // 4, np.uint64(16 * (slot % 4))
                    inside = sums[stop, word, right] - sums[start, word, right]
                    outside = sums[stop, word, left] - sums[start, word, left]
                    counts[i, j] += ((inside - outside) >> shift) & np.uint64(0xFFFF)
    return counts


def direct_counts(codes: Codes, votes: Votes, regions: Ints, bins: Ints, n_bins: int) -> Counts:
    """Return counts of bins in regions, pixel by pixel, int32 (n, m).

    `codes` (height, width): code of each pixel. `votes` (codes, votes per pixel): bins that a code
    votes for. `regions` (n, 4): `[left, top, right, bottom]` in whole pixels inside the image,
    right and bottom exclusive. `bins` (m,): requested bins, out of `n_bins`.
    """
    slots = np.zeros(n_bins, np.int64)
    slots[bins] = np.arange(1, len(bins) + 1)  # slot 0: bins not requested
    return np.ascontiguousarray(_count_slots(codes, votes, regions, slots, len(bins))[:, 1:])


@njit(cache=True)
def _count_slots(codes: Codes, votes: Votes, regions: Ints, slots: Ints, n_bins: int) -> Counts:
    n_codes, n_votes = votes.shape
    counts = np.zeros((len(regions), n_bins + 1), np.int32)
    # Neighbours mostly have the same code; with four histograms, an increment does not depend on
    # the previous one.
    first, second = np.empty(n_codes, np.int32), np.empty(n_codes, np.int32)
    third, fourth = np.empty(n_codes, np.int32), np.empty(n_codes, np.int32)
    for i in range(len(regions)):
        left, top, right, bottom = regions[i, 0], regions[i, 1], regions[i, 2], regions[i, 3]
        for code in range(n_codes):
            first[code] = second[code] = third[code] = fourth[code] = 0
        quads = left + (right - left) // 4 * 4
        for row in range(top, bottom):
            for column in range(left, quads, 4):
                first[np.uintp(codes[row, np.uintp(column)])] += 1
                second[np.uintp(codes[row, np.uintp(column + 1)])] += 1
                third[np.uintp(codes[row, np.uintp(column + 2)])] += 1
                fourth[np.uintp(codes[row, np.uintp(column + 3)])] += 1
            for column in range(quads, right):
                first[np.uintp(codes[row, np.uintp(column)])] += 1
        for code in range(n_codes):
            pixels = first[code] + second[code] + third[code] + fourth[code]
            for vote in range(n_votes):
                counts[i, slots[votes[code, vote]]] += pixels
    return counts


@njit(cache=True)
def bhattacharyya_distances(
    counts: Counts, totals: Ints, reference: Counts, reference_total: int
) -> Array:
    """Return distances d = √(1 - Σ √(p q)), shape (n,), in [0, 1]; 1 if a total is 0.

    Counts are not normalised, so that equal proportions have a distance of exactly 0. `counts` (n,
    m): p in the non-empty bins of the reference q. `totals` (n,): sums of the complete p.
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
