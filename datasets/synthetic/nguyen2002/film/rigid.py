"""Flat rigid things that are moved, turned and resized, and change their look slowly."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from datasets.interface import Image

__all__ = ["Rigid", "lay"]

Array = NDArray[np.float64]


class Rigid:
    """A flat thing around its middle.

    Parameters
    ----------
    looks : sequence of ndarray of float64, shape (h, w, 3)
        One or two: BGR in [0, 255].
    coverage : ndarray of float64, shape (h, w)
        In [0, 1].
    oversize : float
        Pixels of these per pixel of the thing at scale 1.
    """

    def __init__(self, looks: Sequence[Array], coverage: Array, oversize: float) -> None:
        alpha = np.full((*coverage.shape, 1), 255.0)
        self._looks = []
        for look in (looks[0], looks[-1]):
            image = np.concatenate([np.clip(look, 0, 255), alpha], axis=2) * coverage[..., None]
            padded = np.pad(image, [(1, 1), (1, 1), (0, 0)])
            self._looks.append(np.round(padded).astype(np.uint8))
        self._silhouette = np.repeat(self._looks[0][..., 3:], 4, axis=2)
        self._oversize = oversize

    def draw(
        self, canvas: Image, places: Array, scale: float, angle: float, look: float = 0.0
    ) -> None:
        """Lay it over a canvas, averaged over its places during the exposure.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        places : ndarray of float64, shape (k, 2)
            Of its middle [pixels].
        scale : float
        angle : float
            Clockwise [radians].
        look : float
            In [0, 1], from the first look to the second.
        """
        matrices = self._matrices(places, scale, angle)
        first, second = self._looks
        lay(canvas, first, second, round(256 * look), matrices)

    def coverage(
        self, size: tuple[int, int], place: Array, scale: float, angle: float
    ) -> NDArray[np.uint8]:
        """Covered part of each pixel of a canvas (width, height), in [0, 255]."""
        canvas = np.zeros((size[1], size[0], 3), np.uint8)
        matrices = self._matrices(place[None], scale, angle)
        lay(canvas, self._silhouette, self._silhouette, 0, matrices)
        return canvas[..., 0]

    def _matrices(self, places: Array, scale: float, angle: float) -> NDArray[np.int64]:
        """From pixels of a canvas to the thing's, by place; see `lay`."""
        step = self._oversize / scale
        turn = step * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        middle = np.array(self._silhouette.shape[1::-1]) / 2 - 0.5
        shifts = middle - (places - 0.5) @ turn.T
        matrices = np.concatenate([np.tile(turn, (len(places), 1, 1)), shifts[..., None]], axis=2)
        return np.round(matrices * 65536).astype(np.int64)


@njit(cache=True)
def lay(
    canvas: NDArray[np.uint8],
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    share: int,
    matrices: NDArray[np.int64],
) -> None:
    """Lay a mixture of two pictures over a canvas, averaged over their places, bilinear.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Changed in place.
    first, second : ndarray of uint8, shape (h, w, 4)
        Colour premultiplied by the last channel, coverage; the border of one pixel is
        transparent, and the coverage is the same in both.
    share : int
        Of the second, in [0, 256].
    matrices : ndarray of int64, shape (k, 2, 3)
        From column and row of the canvas to those of the pictures, times 65536.
    """
    height, width = canvas.shape[:2]
    h, w = first.shape[:2]
    full = 255 * len(matrices)
    corners_x, corners_y = np.empty(4 * len(matrices)), np.empty(4 * len(matrices))
    for k in range(len(matrices)):
        (a, b, u), (c, d, v) = matrices[k].astype(np.float64) / 65536
        for corner in range(4):
            x, y = (corner & 1) * (w - 1) - u, (corner >> 1) * (h - 1) - v
            corners_x[4 * k + corner] = (d * x - b * y) / (a * d - b * c)
            corners_y[4 * k + corner] = (a * y - c * x) / (a * d - b * c)
    sums = np.empty(4, np.int64)
    for y in range(max(int(corners_y.min()), 0), min(int(corners_y.max()) + 2, height)):
        for x in range(max(int(corners_x.min()), 0), min(int(corners_x.max()) + 2, width)):
            sums[:] = 0
            for k in range(len(matrices)):
                u = matrices[k, 0, 0] * x + matrices[k, 0, 1] * y + matrices[k, 0, 2]
                v = matrices[k, 1, 0] * x + matrices[k, 1, 1] * y + matrices[k, 1, 2]
                i, j = v >> 16, u >> 16
                if i < 0 or j < 0 or i >= h - 1 or j >= w - 1:
                    continue
                right, down = (u >> 8) & 255, (v >> 8) & 255
                for row, weight in ((i, 256 - down), (i + 1, down)):
                    for column, part in ((j, (256 - right) * weight), (j + 1, right * weight)):
                        if first[row, column, 3] == 0:
                            continue
                        for channel in range(4):
                            value = (256 - share) * first[row, column, channel]
                            value += share * second[row, column, channel]
                            sums[channel] += part * value
            cover = sums[3] >> 24
            if sums[3] == 0:
                continue
            for channel in range(3):
                value = canvas[y, x, channel] * (full - cover) + 255 * (sums[channel] >> 24)
                canvas[y, x, channel] = (value + full // 2) // full
