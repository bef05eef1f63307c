"""Pixel rectangles of states (x, y, area) with a fixed aspect."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Regions", "pixel_regions"]


class Regions(NamedTuple):
    """Rectangles cut into parts one below the other, and what holds them all.

    Attributes
    ----------
    parts : ndarray of int64, shape (parts, n, 4)
        `[left, top, right, bottom]` in whole pixels, right and bottom exclusive, inside the
        image; all 0 for a rectangle of which too little is inside.
    pixels : ndarray of int64, shape (parts, n)
        Pixels in each.
    left, top, right, bottom : int
        The window that holds all, right and bottom exclusive; empty where they all are.
    """

    parts: NDArray[np.int64]
    pixels: NDArray[np.int64]
    left: int
    top: int
    right: int
    bottom: int


@njit(cache=True)
def pixel_regions(
    states: NDArray[np.float64],
    aspect: float,
    n_parts: int,
    image_width: int,
    image_height: int,
    least_share: float,
    least_pixels: int,
) -> Regions:
    """Rectangles of states, clipped to the image and cut into parts of equal height.

    Parameters
    ----------
    states : ndarray of float64, shape (n, 3)
        Centre x and y in pixels, area in square pixels.
    aspect : float
        Width over height.
    n_parts : int
        How many; with two the boundary is the row ⌊(top + bottom) / 2⌋.
    image_width, image_height : int
        In pixels.
    least_share, least_pixels : float, int
        A rectangle of which less is inside the image is empty.
    """
    n = len(states)
    parts = np.zeros((n_parts, n, 4), np.int64)
    pixels = np.zeros((n_parts, n), np.int64)
    window_left, window_top, window_right, window_bottom = image_width, image_height, 0, 0
    for i in range(n):
        x, y, area = states[i]
        width = np.sqrt(area * aspect)
        height = area / width
        left, right = np.floor(x - width / 2 + 0.5), np.floor(x + width / 2 + 0.5)
        top, bottom = np.floor(y - height / 2 + 0.5), np.floor(y + height / 2 + 0.5)
        whole = (right - left) * (bottom - top)
        left, right = max(left, 0.0), min(right, float(image_width))
        top, bottom = max(top, 0.0), min(bottom, float(image_height))
        inside = max(right - left, 0.0) * max(bottom - top, 0.0)
        if not (inside >= least_pixels and inside >= least_share * whole):  # true of NaN
            continue
        first, last = int(left), int(right)
        start, stop = int(top), int(bottom)
        for part in range(n_parts):
            begin = start + part * (stop - start) // n_parts
            end = start + (part + 1) * (stop - start) // n_parts
            parts[part, i, 0], parts[part, i, 1] = first, begin
            parts[part, i, 2], parts[part, i, 3] = last, end
            pixels[part, i] = (last - first) * (end - begin)
        window_left, window_right = min(window_left, first), max(window_right, last)
        window_top, window_bottom = min(window_top, start), max(window_bottom, stop)
    return Regions(
        parts,
        pixels,
        window_left,
        window_top,
        max(window_right, window_left),
        max(window_bottom, window_top),
    )
