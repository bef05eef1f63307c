"""Flat pictures behind everything: rows of a panorama, each shifted on its own."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["draw_rows", "instants"]


def instants(displacement: float) -> NDArray[np.float64]:
    """Moments of the exposure to average, in [-0.5, 0.5]; their number is a power of two.

    The farther a picture moves [pixels], the more: between two of them it moves at most
    about two pixels, which the bilinear sampling bridges.
    """
    count = 1
    while count < 8 and abs(displacement) > 2 * count - 1.4:
        count *= 2
    return (np.arange(count) + 0.5) / count - 0.5


@njit(cache=True)
def draw_rows(
    canvas: NDArray[np.uint8],
    panorama: NDArray[np.uint8],
    top: int,
    lefts: NDArray[np.int64],
    first: int,
    last: int,
) -> None:
    """Fill rows of a canvas from a panorama, bilinear, averaged over instants.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Changed in place.
    panorama : ndarray of uint8, shape (rows, columns, 3)
        At least as wide everywhere as what is asked for.
    top : int
        Place of the panorama's first row in the canvas [1/64 pixel].
    lefts : ndarray of int64, shape (2**k, rows)
        Panorama column at the canvas' left border, by instant and row [1/64 pixel].
    first, last : int
        Rows of the canvas to fill, the last excluded.
    """
    width = canvas.shape[1]
    shift = 12
    while 1 << (shift - 12) < len(lefts):
        shift += 1
    half = 1 << (shift - 1)
    sums = np.empty(3 * width, np.int32)
    for y in range(first, last):
        place = (y << 6) - top
        row = min(max(place >> 6, 0), len(panorama) - 1)
        below = min(row + 1, len(panorama) - 1)
        v = place & 63
        sums[:] = half
        for k in range(len(lefts)):
            for line, weight in ((row, 64 - v), (below, v)):
                if weight == 0:
                    continue
                left = lefts[k, line]
                u = left & 63
                a, b = np.int32((64 - u) * weight), np.int32(u * weight)
                start = 3 * (left >> 6)
                source = panorama[line].ravel()[start : start + 3 * width + 3]
                for i in range(3 * width):
                    sums[i] += a * np.int32(source[i]) + b * np.int32(source[i + 3])
        out = canvas[y].ravel()
        for i in range(3 * width):
            out[i] = sums[i] >> shift
