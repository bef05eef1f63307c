"""Colours of an image taken together in cells of a grid, so that a colour is judged only once."""

from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.interface import Image

__all__ = ["ColourCells", "cells_inside", "colour_cells"]

Ints: TypeAlias = NDArray[np.int64]
Cells: TypeAlias = NDArray[np.int32]


class ColourCells(NamedTuple):
    """The K cells of a colour grid that an image occupies, in the grid's order."""

    colours: NDArray[np.float64]  # (K, 3): mean RGB of each cell's pixels, in [0, 1]
    image: Cells  # (rows, columns): cell of every pixel, in [0, K)
    sizes: Ints  # (K,): pixels of each, at least 1


@njit(cache=True)
def colour_cells(image: Image, levels: int = 20) -> ColourCells:
    """Cells of equal size in a BGR image, `levels`, 1 to 64, along each of red, green and blue."""
    rows, columns, _ = image.shape
    totals = np.zeros((levels**3, 4), np.int64)  # of red, green and blue, and pixels
    cells = np.empty((rows, columns), np.int32)
    for row in range(rows):
        for column in range(columns):
            blue = np.int64(image[row, column, 0])
            green = np.int64(image[row, column, 1])
            red = np.int64(image[row, column, 2])
            cell = (red * levels >> 8) * levels + (green * levels >> 8)
            cell = cell * levels + (blue * levels >> 8)
            cells[row, column] = cell
            totals[cell, 0] += red
            totals[cell, 1] += green
            totals[cell, 2] += blue
            totals[cell, 3] += 1
    occupied = np.flatnonzero(totals[:, 3])
    numbers = np.empty(len(totals), np.int32)
    colours = np.empty((len(occupied), 3))
    sizes = np.empty(len(occupied), np.int64)
    for number, cell in enumerate(occupied):
        numbers[cell] = number
        sizes[number] = totals[cell, 3]
        for channel in range(3):
            colours[number, channel] = totals[cell, channel] / (255.0 * sizes[number])
    for row in range(rows):
        for column in range(columns):
            cells[row, column] = numbers[cells[row, column]]
    return ColourCells(colours, cells, sizes)


def cells_inside(cells: ColourCells, x0: int, y0: int, x1: int, y1: int) -> Ints:
    """Pixels of each cell, (K,), in the part of a rectangle that is in the image.

    Columns x0 to x1 and rows y0 to y1, the latter of each not included.
    """
    inside = cells.image[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
    return _counts(inside, len(cells.sizes))


@njit(cache=True)
def _counts(inside: Cells, n: int) -> Ints:
    counts = np.zeros(n, np.int64)
    for row in range(inside.shape[0]):
        for column in range(inside.shape[1]):
            counts[inside[row, column]] += 1
    return counts
