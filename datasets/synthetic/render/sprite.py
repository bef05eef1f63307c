"""Things that lie over the ground: colour with coverage, drawn at any place and size."""

from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.compositing import blend_sprite

__all__ = ["Sprite", "blurred", "superellipse"]


class Sprite:
    """Colour with coverage, in a pyramid so that it can be drawn smaller without aliasing.

    Parameters
    ----------
    colour : ndarray of float64, shape (h, w, 3)
        BGR in [0, 255]; what it says where nothing is covered does not matter.
    coverage : ndarray of float64, shape (h, w)
        In [0, 1].
    """

    def __init__(self, colour: NDArray[np.float64], coverage: NDArray[np.float64]) -> None:
        self._coverage = coverage
        self.height, self.width = coverage.shape
        opaque = np.concatenate([colour, np.full((*coverage.shape, 1), 255.0)], axis=2)
        self._image = np.clip(opaque, 0, 255) * coverage[:, :, None]

    @cached_property
    def levels(self) -> list[NDArray[np.uint8]]:
        """Premultiplied images with a transparent border, each at half the resolution."""
        depth = max(1, min(self.height, self.width).bit_length() - 2)
        padding = [(0, -size % (1 << depth)) for size in (self.height, self.width)]
        image = np.pad(self._image, [*padding, (0, 0)])
        levels = []
        for _ in range(depth):
            rounded = np.floor(image + 0.5).astype(np.uint8)
            levels.append(np.pad(rounded, [(1, 1), (1, 1), (0, 0)]))
            upper, lower = image[0::2], image[1::2]
            image = (upper[:, 0::2] + upper[:, 1::2] + lower[:, 0::2] + lower[:, 1::2]) / 4
        return levels

    def silhouette(self, level: float) -> Self:
        """The same coverage in one grey level."""
        return type(self)(np.full((*self._coverage.shape, 3), level), self._coverage)

    def shadow(self, darkness: float, softness: int) -> Self:
        """What the sprite keeps of the light: black, soft, wider by `softness` on each side.

        Parameters
        ----------
        darkness : float
            Coverage under the middle, in [0, 1].
        softness : int
            Half the width of the soft edge, in the sprite's pixels.
        """
        coverage = blurred(np.pad(self._coverage, softness), max(1, softness // 3)) * darkness
        return type(self)(np.zeros((*coverage.shape, 3)), coverage)

    def draw(self, canvas: NDArray[np.uint8], centres: NDArray[np.float64], scale: float) -> None:
        """Lay the sprite over a canvas.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        centres : ndarray of float64, shape (k, 2)
            Where the sprite's middle is at k instants of the exposure, in pixels; k is a
            power of two. The average over them is drawn.
        scale : float
            Canvas pixels per pixel of the sprite.
        """
        level = 0
        while scale <= 0.7 and level + 1 < len(self.levels):
            level, scale = level + 1, scale * 2
        middle = np.array([self.width, self.height]) / (2 << level) * scale
        corners = np.round((centres - middle) * 64).astype(np.int64)
        blend_sprite(canvas, self.levels[level], corners[:, 0], corners[:, 1], round(65536 / scale))


def superellipse(
    height: int, width: int, half_height: float, half_width: float, power: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Coverage of a superellipse in the middle of an image, with its own coordinates.

    Parameters
    ----------
    height, width : int
        Size of the image, in pixels.
    half_height, half_width : float
        Half axes, in pixels.
    power : {2, 4}
        2 is an ellipse, 4 a rectangle with rounded corners.

    Returns
    -------
    x, y : ndarray of float64, shape (height, width)
        Coordinates in half axes: the outline is ``|x|**power + |y|**power = 1``.
    coverage : ndarray of float64, shape (height, width)
        Covered part of each pixel, from 4 x 4 samples.
    """
    fine = 4
    rows = ((np.arange(height * fine) + 0.5) / fine - height / 2) / half_height
    columns = ((np.arange(width * fine) + 0.5) / fine - width / 2) / half_width
    y, x = np.meshgrid(rows, columns, indexing="ij")
    u, v = x * x, y * y
    inside = (u + v <= 1) if power == 2 else (u * u + v * v <= 1)
    samples = inside.reshape(height, fine, width, fine).sum(axis=(1, 3))
    middle = fine // 2
    x_middle = (x[middle::fine, middle::fine] + x[middle - 1 :: fine, middle - 1 :: fine]) / 2
    y_middle = (y[middle::fine, middle::fine] + y[middle - 1 :: fine, middle - 1 :: fine]) / 2
    return x_middle, y_middle, samples / (fine * fine)


def blurred(values: NDArray[np.float64], radius: int) -> NDArray[np.float64]:
    """Three passes of a box of 2 `radius` + 1 pixels, nearly Gaussian; zero outside."""
    for _ in range(3):
        for axis in range(2):
            padding = [(0, 0), (0, 0)]
            padding[axis] = (radius + 1, radius)
            sums = np.cumsum(np.pad(values, padding), axis=axis)
            ends = np.take(sums, np.arange(2 * radius + 1, sums.shape[axis]), axis=axis)
            starts = np.take(sums, np.arange(sums.shape[axis] - 2 * radius - 1), axis=axis)
            values = (ends - starts) / (2 * radius + 1)
    return values
