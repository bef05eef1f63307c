"""Sprites (images with coverage that are drawn at any position and size) and panoramas.

All pixel arithmetic uses integers, so that all platforms give the same bytes.
"""

from functools import cached_property
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Array


class Sprite:
    """Image with coverage, as a pyramid, so that smaller sizes are drawn without aliasing.

    `colour`, shape (h, w, 3), is BGR in [0, 255]; the colours of uncovered pixels have no effect.
    `coverage`, shape (h, w), is in [0, 1].
    """

    def __init__(self, colour: Array, coverage: Array) -> None:
        self._coverage = coverage
        self.height, self.width = coverage.shape
        opaque = np.concatenate([colour, np.full((*coverage.shape, 1), 255.0)], axis=2)
        self._image = np.clip(opaque, 0, 255) * coverage[:, :, None]

    @cached_property
    def levels(self) -> list[NDArray[np.uint8]]:
        """Premultiplied images with a transparent border; the resolution halves at each level."""
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
        """Return a sprite with the same coverage and one grey level."""
        return type(self)(np.full((*self._coverage.shape, 3), level), self._coverage)

    def shadow(self, darkness: float, softness: int) -> Self:
        """Return a black, soft shadow of the sprite, which is larger by `softness` on each side.

        `darkness` is the coverage in the centre, in [0, 1]. `softness` is half the width of the
        soft edge [pixels of the sprite].
        """
        coverage = box_blur(np.pad(self._coverage, softness), max(1, softness // 3)) * darkness
        return type(self)(np.zeros((*coverage.shape, 3)), coverage)

    def draw(self, canvas: NDArray[np.uint8], centres: Array, scale: float) -> None:
        """Blend the sprite over a canvas in place, averaged over its positions during the exposure.

        `centres`, shape (2**k, 2), are these positions of the sprite's centre [pixels]. `scale` is
        the number of canvas pixels per pixel of the sprite.
        """
        level = 0
        while scale <= 0.7 and level + 1 < len(self.levels):
            level, scale = level + 1, scale * 2
        middle = np.array([self.width, self.height]) / (2 << level) * scale
        corners = np.round((centres - middle) * 64).astype(np.int64)
        blend_sprite(canvas, self.levels[level], corners[:, 0], corners[:, 1], round(65536 / scale))


def superellipse(
    height: int, width: int, half_height: float, half_width: float, power: int
) -> tuple[Array, Array, Array]:
    """Return coordinates `x` and `y` and the coverage of a superellipse in the image centre.

    Sizes are in pixels. The coordinates are in half axes: the outline is ``|x|**power + |y|**power
    = 1``. A power of 2 is an ellipse, a power of 4 a rectangle with rounded corners. The coverage
    of a pixel is measured with 4 x 4 samples. The three results have the shape (height, width).
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


def box_blur(values: Array, radius: int) -> Array:
    """Blur by three passes of a box filter of 2 `radius` + 1 pixels; outside the image is zero."""
    for _ in range(3):
        for axis in range(2):
            padding = [(0, 0), (0, 0)]
            padding[axis] = (radius + 1, radius)
            sums = np.cumsum(np.pad(values, padding), axis=axis)
            ends = np.take(sums, np.arange(2 * radius + 1, sums.shape[axis]), axis=axis)
            starts = np.take(sums, np.arange(sums.shape[axis] - 2 * radius - 1), axis=axis)
            values = (ends - starts) / (2 * radius + 1)
    return values


def cut_window(
    texture: NDArray[np.uint8], x: int, y: int, height: int, width: int
) -> NDArray[np.uint8]:
    """Return a part of a texture at a sub-pixel position, by bilinear interpolation.

    `x` and `y` are the upper left corner in 1/64 pixel. The part plus one pixel on each side must
    lie within the texture.
    """
    picture = np.empty((height, width, 3), np.uint8)
    draw_rows(picture, texture, -y, np.full((1, len(texture)), x), 0, height)
    return picture


@njit(cache=True)
def _span(lowest: int, highest: int, size: int, step: int, limit: int) -> tuple[int, int]:
    """Return the range of pixels within `limit` that a sprite of `size` can touch.

    The corner of the sprite lies between `lowest` and `highest`. Both ends of an empty range are
    equal.
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
    """Blend a sprite over a canvas in place, averaged over its positions during the exposure.

    `sprite`, shape (h + 2, w + 2, 4), is premultiplied by its last channel, the coverage, and has a
    transparent border of one pixel. `left` and `top`, shape (2**k,), are the positions of its
    corner inside the border, in 1/64 canvas pixel. `step` is the number of sprite pixels per canvas
    pixel, times 65536.
    """
    height, width = canvas.shape[:2]
    h, w = sprite.shape[0] - 2, sprite.shape[1] - 2
    shift = 8
    while 1 << (shift - 8) < len(left):
        shift += 1
    first_x, last_x = _span(left.min(), left.max(), w, step, width)
    first_y, last_y = _span(top.min(), top.max(), h, step, height)
    sums = np.empty(4 * (last_x - first_x), np.uint32)
    mixed = np.zeros(4 * (w + 2), np.uint32)
    begin, end = 0, 0  # range of sprite columns outside which the interpolated row is transparent
    for y in range(first_y, last_y):
        sums[:] = 0
        touched_first, touched_last = last_x, first_x
        mixed_row = -1
        for k in range(len(left)):
            v = ((((y << 6) + 32 - top[k]) * step) >> 6) + 32768
            if v < 0 or v >= (h + 1) << 16:
                continue
            if v != mixed_row:  # Without vertical motion, the row is equal at all times.
                mixed_row = v
                above, below = sprite[v >> 16].ravel(), sprite[(v >> 16) + 1].ravel()
                lower = np.uint32((v >> 8) & 255)
                mixed[4 * begin : 4 * end] = 0
                begin, end = _opaque(above, below)
                _add(
                    mixed[4 * begin : 4 * end],
                    above[4 * begin :],
                    np.uint32(256 - lower),
                    below[4 * begin :],
                    lower,
                )
            if begin == end:
                continue
            first, last = _span(left[k], left[k], w, step, width)
            if step == 65536:  # Weights that are equal for all pixels allow vector instructions.
                u = ((((first << 6) + 32 - left[k]) * step) >> 6) + 32768
                column = u >> 16
                skipped = max(begin - 1 - column, 0)
                last = min(last, first + end - column)
                first, column = first + skipped, column + skipped
                if first >= last:
                    continue
                right, shifted = np.uint32((u >> 8) & 255), mixed[4 * column :]
                out = sums[4 * (first - first_x) : 4 * (last - first_x)]
                _add(out, shifted, np.uint32(256 - right), shifted[4:], right)
            else:
                for x in range(first, last):
                    u = ((((x << 6) + 32 - left[k]) * step) >> 6) + 32768
                    right = np.uint32((u >> 8) & 255)
                    i = 4 * (u >> 16)
                    if i + 4 < 4 * begin or i >= 4 * end:
                        continue
                    for c in range(4):
                        sums[4 * (x - first_x) + c] += (256 - right) * mixed[i + c] + right * mixed[
                            i + 4 + c
                        ]
            touched_first, touched_last = min(touched_first, first), max(touched_last, last)
        if touched_first < touched_last:
            touched_sums = sums[4 * (touched_first - first_x) :]
            _blend_row(canvas[y, touched_first:touched_last], touched_sums, np.uint32(shift))


@njit(cache=True)
def _opaque(above: NDArray[np.uint8], below: NDArray[np.uint8]) -> tuple[int, int]:
    """Return the range of columns outside which both rows, shape (4 n,), are 0."""
    first, last = 0, len(above) // 4
    while last > 0 and _clear(above, below, last - 1):
        last -= 1
    while first < last and _clear(above, below, first):
        first += 1
    return first, last


@njit(cache=True)
def _clear(above: NDArray[np.uint8], below: NDArray[np.uint8], column: int) -> bool:
    """Return whether a column is 0 in both rows."""
    total = np.uint8(0)
    for i in range(4 * column, 4 * column + 4):
        total |= above[i] | below[i]
    return bool(total == 0)


@njit(cache=True)
def _add(
    sums: NDArray[np.uint32],
    first_row: NDArray[np.unsignedinteger],
    weight: np.uint32,
    second_row: NDArray[np.unsignedinteger],
    other_weight: np.uint32,
) -> None:
    """Add two weighted rows to `sums` in place; unsigned 32-bit numbers allow vectorisation."""
    for i in range(len(sums)):
        sums[i] += weight * np.uint32(first_row[i]) + other_weight * np.uint32(second_row[i])


@njit(cache=True)
def _blend_row(row: NDArray[np.uint8], sums: NDArray[np.uint32], shift: np.uint32) -> None:
    """Blend sums (4 n,), which are premultiplied and scaled by 2**`shift`, over a row (n, 3)."""
    opaque = np.uint32(65280)
    for x in range(len(row)):
        left = np.uint32(opaque - (sums[4 * x + 3] >> shift))
        for c in range(3):
            colour = np.uint32(sums[4 * x + c] >> shift)
            value = np.uint32(row[x, c] * left + np.uint32(255) * colour)
            row[x, c] = np.uint32(value + opaque // 2) // opaque


def instants(displacement: float) -> Array:
    """Return the times within the exposure, in [-0.5, 0.5], at which an object is drawn.

    The drawings are averaged. The number of times is a power of two, at most 8. `displacement` is
    the motion during the whole exposure [pixels]. Up to 16 pixels, an object moves by about two
    pixels or less from time to time; bilinear interpolation fills these gaps.
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
    """Fill the canvas rows from `first` (inclusive) to `last` (exclusive) from a panorama in place.

    The interpolation is bilinear and averages over times of the exposure. `top` is the position of
    the panorama's first row in the canvas. `lefts`, shape (2**k, rows), is the panorama column at
    the left canvas border for every time and panorama row. Both are in 1/64 pixel. The panorama
    must cover the whole width.
    """
    width = canvas.shape[1]
    shift = 12
    while 1 << (shift - 12) < len(lefts):
        shift += 1
    lines = np.zeros((2, 3 * width), np.uint32)  # two rows of the panorama, averaged over the times
    held = np.array([-1, -1])  # indices of these rows
    for y in range(first, last):
        place = (y << 6) - top
        row = min(max(place >> 6, 0), len(panorama) - 1)
        below = min(row + 1, len(panorama) - 1)
        v = place & 63
        for line in (row, below):
            if held[line & 1] == line or (line == below and v == 0):
                continue
            held[line & 1] = line
            averaged = lines[line & 1]
            averaged[:] = 0
            for k in range(len(lefts)):
                left = lefts[k, line]
                source = panorama[line].ravel()[3 * (left >> 6) :]
                _add(
                    averaged, source, np.uint32(64 - (left & 63)), source[3:], np.uint32(left & 63)
                )
        _write_row(
            canvas[y].ravel(),
            lines[row & 1],
            np.uint32(64 - v),
            lines[below & 1],
            np.uint32(v),
            np.uint32(shift),
        )


@njit(cache=True)
def _write_row(
    out: NDArray[np.uint8],
    first_row: NDArray[np.uint32],
    weight: np.uint32,
    second_row: NDArray[np.uint32],
    other_weight: np.uint32,
    shift: np.uint32,
) -> None:
    """Write the sum of two weighted rows, divided by 2**`shift` and rounded, to a canvas row."""
    half = np.uint32(1) << np.uint32(shift - np.uint32(1))
    for i in range(len(out)):
        out[i] = np.uint32(half + weight * first_row[i] + other_weight * second_row[i]) >> shift
