"""A limb that swings: the nearer its columns are to the joint, the less they go up and down.

Arithmetic is on integers, as in `engine.compositing`.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["blend_swung"]

Integers = NDArray[np.int64]


@njit(cache=True)
def blend_swung(
    canvas: NDArray[np.uint8],
    picture: NDArray[np.uint8],
    left: Integers,
    top: Integers,
    swings: Integers,
    shares: Integers,
) -> None:
    """Lay a limb over a canvas, averaged over its places during the exposure.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Changed in place.
    picture : ndarray of uint8, shape (h + 2, w + 2, 4)
        The limb at the canvas' resolution; as a level of `Sprite`.
    left, top : ndarray of int64, shape (2**k,)
        Corner of the limb within its border when it does not swing, at each instant, in
        1/64 pixel.
    swings : ndarray of int64, shape (2**k,)
        How far its end is down from there, in 1/64 pixel.
    shares : ndarray of int64, shape (w + 2,)
        Part of the swing that each column goes along with, times 256.
    """
    height, width = canvas.shape[:2]
    h, w = picture.shape[0] - 2, picture.shape[1] - 2
    shift = 4
    while 1 << (shift - 4) < len(left):
        shift += 1
    sums = np.empty((height, 4), np.int64)
    for x in range(width):
        sums[:] = 0
        for k in range(len(left)):
            u = 64 * (x + 1) - left[k]
            i, right = u >> 6, u & 63
            if i < 0 or i > w:
                continue
            share = (64 - right) * shares[i] + right * shares[i + 1]
            down = top[k] + ((swings[k] * share + 8192) >> 14)
            for y in range(height):
                v = 64 * (y + 1) - down
                j, lower = v >> 6, v & 63
                if j < 0 or j > h:
                    continue
                for c in range(4):
                    above = (64 - right) * picture[j, i, c] + right * picture[j, i + 1, c]
                    below = (64 - right) * picture[j + 1, i, c] + right * picture[j + 1, i + 1, c]
                    sums[y, c] += (64 - lower) * above + lower * below
        for y in range(height):
            cover = sums[y, 3] >> shift
            if cover == 0:
                continue
            for c in range(3):
                value = canvas[y, x, c] * (65280 - cover) + 255 * (sums[y, c] >> shift)
                canvas[y, x, c] = (value + 32640) // 65280
