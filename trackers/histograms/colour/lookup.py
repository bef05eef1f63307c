"""A code for every colour there is, looked up pixel by pixel.

In a table's index the bits of blue, green and red take turns. So colours that differ a little
in any channel lie close together, and the pixels of an image, noise and all, keep to few lines
of the processor's cache: half the time of a table by blue, green and red.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.interface import Image

__all__ = ["ColourTable", "colour_table", "looked_up"]

ColourTable: TypeAlias = NDArray[np.uint16]
"""Code of every 8-bit colour, shape (2²⁴,), 32 MiB; made by `colour_table`."""

_BITS = np.arange(8)
_SPREAD = ((np.arange(256)[:, np.newaxis] >> _BITS & 1) << 3 * _BITS).sum(axis=1).astype(np.uint32)
"""Each byte with its bits three places apart."""


def colour_table(codes: Callable[[Image], NDArray[np.uint16]]) -> ColourTable:
    """Ask for the code of every colour.

    Parameters
    ----------
    codes : callable
        Gives the code of each pixel of an image, from its colour alone.
    """
    plane = np.empty((256, 256, 3), np.uint8)
    plane[..., 1] = np.arange(256)[:, np.newaxis]
    plane[..., 2] = np.arange(256)
    places = _SPREAD[:, np.newaxis] << 1 | _SPREAD
    table = np.empty(256**3, np.uint16)
    for blue in range(256):
        plane[..., 0] = blue
        table[_SPREAD[blue] << 2 | places] = codes(plane)
    return table


@njit(cache=True)
def looked_up(image: Image, table: ColourTable) -> NDArray[np.uint16]:
    """Code of every pixel, shape (height, width)."""
    height, width, _ = image.shape
    found = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it.
            blue = _SPREAD[np.uintp(image[row, column, 0])]
            green = _SPREAD[np.uintp(image[row, column, 1])]
            red = _SPREAD[np.uintp(image[row, column, 2])]
            found[row, column] = table[np.uintp(blue << 2 | green << 1 | red)]
    return found
