"""Things that lie over the ground: colour with coverage, drawn at any place and size.

All arithmetic on pixels is on integers, so that every platform gives the same bytes.
"""

from functools import cached_property
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Sprite", "blend_sprite", "blurred", "develop", "superellipse", "window"]


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


@njit(cache=True)
def window(
    texture: NDArray[np.uint8], x: int, y: int, height: int, width: int
) -> NDArray[np.uint8]:
    """Cut a picture out of a texture at a sub-pixel place, bilinear.

    Parameters
    ----------
    texture : ndarray of uint8, shape (h, w, 3)
    x, y : int
        Left top corner in 1/64 pixel; the window plus one pixel lies within the texture.
    height, width : int
        Size of the picture, in pixels.
    """
    picture = np.empty((height, width, 3), np.uint8)
    left, top, u, v = 3 * (x >> 6), y >> 6, x & 63, y & 63
    a, b, c, d = (64 - u) * (64 - v), u * (64 - v), (64 - u) * v, u * v
    for row in range(height):
        upper = texture[top + row].ravel()[left : left + 3 * width + 3]
        lower = texture[top + row + 1].ravel()[left : left + 3 * width + 3]
        out = picture[row].ravel()
        for i in range(3 * width):
            value = a * np.int32(upper[i]) + b * np.int32(upper[i + 3])
            value += c * np.int32(lower[i]) + d * np.int32(lower[i + 3])
            out[i] = (value + 2048) >> 12
    return picture


@njit(cache=True)
def _span(lowest: int, highest: int, size: int, step: int, limit: int) -> tuple[int, int]:
    """First pixel and the one after the last within `limit` that a sprite of `size` touches.

    Its corner lies between `lowest` and `highest`; where nothing is touched both are equal.
    """
    first = -(-(lowest - 32 - (32768 << 6) // step) // 64)
    last = (highest - 32 + ((((size << 16) + 32768) << 6) - 1) // step) // 64 + 1
    first = min(max(first, 0), limit)
    return first, max(min(last, limit), first)


@njit(cache=True)
def blend_sprite(
    canvas: NDArray[np.uint8],
    sprite: NDArray[np.uint8],
    left: NDArray[np.int64],
    top: NDArray[np.int64],
    step: int,
) -> None:
    """Lay a sprite over a canvas, averaged over its places during the exposure.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Changed in place.
    sprite : ndarray of uint8, shape (h + 2, w + 2, 4)
        Colour premultiplied by the last channel, coverage; its border of one pixel is
        transparent.
    left, top : ndarray of int64, shape (2**k,)
        Corner of the sprite within its border, at each instant, in 1/64 canvas pixel.
    step : int
        Sprite pixels per canvas pixel, times 65536.
    """
    height, width = canvas.shape[:2]
    h, w = sprite.shape[0] - 2, sprite.shape[1] - 2
    shift = 8
    while 1 << (shift - 8) < len(left):
        shift += 1
    first_x, last_x = _span(left.min(), left.max(), w, step, width)
    first_y, last_y = _span(top.min(), top.max(), h, step, height)
    sums = np.empty(4 * width, np.int32)
    mixed = np.empty(4 * (w + 2), np.int32)
    for y in range(first_y, last_y):
        sums[4 * first_x : 4 * last_x] = 0
        for k in range(len(left)):
            v = ((((y << 6) + 32 - top[k]) * step) >> 6) + 32768
            if v < 0 or v >= (h + 1) << 16:
                continue
            lower = np.int32((v >> 8) & 255)
            above, below = sprite[v >> 16].ravel(), sprite[(v >> 16) + 1].ravel()
            for i in range(4 * (w + 2)):
                mixed[i] = (256 - lower) * np.int32(above[i]) + lower * np.int32(below[i])
            first, last = _span(left[k], left[k], w, step, width)
            u = ((((first << 6) + 32 - left[k]) * step) >> 6) + 32768
            if step == 65536:  # the same weights for all pixels: several at once
                right = np.int32((u >> 8) & 255)
                shifted = mixed[4 * (u >> 16) :]
                out = sums[4 * first : 4 * last]
                for i in range(len(out)):
                    out[i] += (256 - right) * shifted[i] + right * shifted[i + 4]
                continue
            for x in range(first, last):
                u = ((((x << 6) + 32 - left[k]) * step) >> 6) + 32768
                right = np.int32((u >> 8) & 255)
                for c in range(4):
                    i = 4 * (u >> 16) + c
                    sums[4 * x + c] += (256 - right) * mixed[i] + right * mixed[i + 4]
        for x in range(first_x, last_x):
            cover = sums[4 * x + 3] >> shift
            if cover == 0:
                continue
            for c in range(3):
                value = canvas[y, x, c] * (65280 - cover) + 255 * (sums[4 * x + c] >> shift)
                canvas[y, x, c] = (value + 32640) // 65280


@njit(cache=True)
def develop(
    canvas: NDArray[np.uint8],
    row_gain: NDArray[np.int32],
    column_gain: NDArray[np.int32],
    table: NDArray[np.int32],
    random: NDArray[np.uint8],
) -> None:
    """Apply light and sensor noise to a canvas, in place.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
    row_gain, column_gain : ndarray of int32, shapes (height,) and (width,)
        Gains times 1024; their product applies.
    table : ndarray of int32, shape (256,)
        Noise of each random byte, in 1/16 grey level.
    random : ndarray of uint8, shape (height * width * 3,)
    """
    height, width = canvas.shape[:2]
    for y in range(height):
        out = canvas[y].ravel()
        dice = random[3 * width * y : 3 * width * (y + 1)]
        for x in range(width):
            gain = row_gain[y] * column_gain[x]
            for i in range(3 * x, 3 * x + 3):
                value = ((out[i] * gain) >> 16) + table[dice[i]]
                out[i] = min(max((value + 8) >> 4, 0), 255)
