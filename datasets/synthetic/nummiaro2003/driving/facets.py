"""Facets of solids, the pictures on them, and the packing of these.

What kernels are given: tuples of arrays.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST", "Facets", "Lens", "Pictures", "Pose", "blank", "packed"]

MOST = 8
"""Corners of a facet."""


class Facets(NamedTuple):
    """Facets of a solid, from front to back wherever one can hide another.

    Attributes
    ----------
    corners : ndarray of float64, shape (n, MOST, 3)
        In the solid's own frame: right, up, ahead [metres].
    counts : ndarray of int64, shape (n,)
        Corners that count.
    normals : ndarray of float64, shape (n, 3)
        Of length 1, outwards.
    kinds : ndarray of int64, shape (n,)
        Number of the picture.
    places : ndarray of float64, shape (n, 2, 4)
        Column and row in the picture, each as three factors of the place and a constant.
    soft : ndarray of bool, shape (n,)
        A shadow, as dark as its picture's blue says; takes no samples.
    """

    corners: NDArray[np.float64]
    counts: NDArray[np.int64]
    normals: NDArray[np.float64]
    kinds: NDArray[np.int64]
    places: NDArray[np.float64]
    soft: NDArray[np.bool_]


class Pictures(NamedTuple):
    """Periodic pictures at falling resolutions, one after the other.

    Attributes
    ----------
    pixels : ndarray of uint32, shape (k,)
        Red, green and blue in bytes, blue the lowest.
    starts : ndarray of int64, shape (pictures, levels)
        Where in `pixels` each begins; -1 beyond the coarsest.
    sizes : ndarray of int64, shape (pictures, 2)
        Width and height of the finest as powers of two.
    """

    pixels: NDArray[np.uint32]
    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]


class Lens(NamedTuple):
    """Focal length and optical centre in the window that is painted [pixels]."""

    focal: float
    column: float
    row: float


class Pose(NamedTuple):
    """Where a solid is for the camera, and its light.

    Attributes
    ----------
    turn : ndarray of float64, shape (3, 3)
        From the solid's frame to the camera's: right, down, ahead.
    place : ndarray of float64, shape (3,)
        Of the solid's origin in the camera's frame [metres].
    gains : ndarray of int64, shape (n,)
        Light on each facet, times 256.
    shading : ndarray of float64, shape (2, 4)
        Column and row in the picture of shade, each as three factors of the place in the
        camera's frame and a constant.
    """

    turn: NDArray[np.float64]
    place: NDArray[np.float64]
    gains: NDArray[np.int64]
    shading: NDArray[np.float64]


def packed(images: Sequence[NDArray[np.float64]]) -> Pictures:
    """Pictures at all resolutions down to one pixel along a side.

    Parameters
    ----------
    images : sequence of ndarray of float64, shape (height, width, 3)
        BGR in [0, 255]; their sides are powers of two.
    """
    depth = 1 + max(min(image.shape[:2]).bit_length() - 1 for image in images)
    pixels: list[NDArray[np.uint32]] = []
    starts = np.full((len(images), depth), -1)
    sizes = np.array([[side.bit_length() - 1 for side in im.shape[1::-1]] for im in images])
    place = 0
    for number, finest in enumerate(images):
        image = np.clip(finest, 0, 255)
        for level in range(1 + int(sizes[number].min())):
            starts[number, level] = place
            blue, green, red = np.moveaxis(np.floor(image + 0.5).astype(np.uint32), 2, 0)
            pixels.append((blue | green << 8 | red << 16).ravel())
            place += len(pixels[-1])
            if level < sizes[number].min():
                half = image[0::2] + image[1::2]
                image = (half[:, 0::2] + half[:, 1::2]) / 4
    return Pictures(np.concatenate(pixels), starts.astype(np.int64), sizes.astype(np.int64))


def blank(count: int = 1, level: float = 128.0) -> Pictures:
    """Pictures of one grey pixel each."""
    return packed([np.full((1, 1, 3), level)] * count)
