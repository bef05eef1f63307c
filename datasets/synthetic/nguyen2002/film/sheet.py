"""Painted images of single objects with their coverage, and moving rigid objects."""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.texture import fractal

# pixels per unit of length of sheets that are painted at their size in the image
UNIT = 100.0
FINE = 3  # supersampling per axis

# colours of several objects, BGR in [0, 255]
PAINTS = (
    (44, 48, 168), (140, 86, 36), (70, 120, 58), (52, 150, 206), (172, 182, 186), (120, 64, 96),
    (92, 104, 116), (150, 136, 60), (66, 92, 148), (190, 160, 120), (58, 62, 70), (98, 150, 170),
)  # fmt: skip
LIGHTS = ((214, 222, 226), (196, 216, 226), (226, 216, 200), (170, 206, 220))
WOODS = ((78, 124, 168), (92, 130, 158), (66, 98, 132), (110, 146, 172))
GLASS, DARK = np.array([104.0, 92.0, 80.0]), np.array([42.0, 40.0, 40.0])


def point_list(x: Array, y: Array) -> list[tuple[float, float]]:
    """Return the points with the given coordinates as pairs (x, y)."""
    return list(zip(x.tolist(), y.tolist(), strict=True))


def adjacent_spans(
    random: Generator, width: float, wide: tuple[float, float], gap: float = 0.0, rest: float = 0.01
) -> Iterator[tuple[float, float]]:
    """Yield left ends and widths of adjacent objects, until at most `rest` of the width is free.

    Each width is sampled when it is requested, from the range `wide`.
    """
    left = 0.0
    while left < width - rest:
        object_width = min(random.uniform(*wide), width - left)
        yield left, object_width
        left += object_width + gap


class PaintedSheet:
    """Object painted on a transparent sheet with a size [metres] and a scale [pixels/metre].

    `colour` is the initial colour of the whole `painting`, BGR in [0, 255]. `anchor` is the point
    by which the object is positioned; initially it is the centre [metres].
    """

    def __init__(self, width: float, height: float, scale: float, colour: ArrayLike) -> None:
        self._size = max(round(width * scale), 1), max(round(height * scale), 1)
        fine = np.empty((self._size[1] * FINE, self._size[0] * FINE, 3), np.uint8)
        fine[:] = np.clip(np.asarray(colour), 0, 255)
        self.painting = Painting(fine, FINE * scale)
        self.anchor = width / 2, height / 2
        self._coverage = np.zeros(fine.shape[:2], np.uint8)

    def cover(self, *outline: tuple[float, float]) -> None:
        """Make the inside of a polygon opaque; `outline`: corners [metres]."""
        points = np.round(np.array(outline) * self.painting.scale * 16).astype(np.int32)
        cv2.fillPoly(self._coverage, [points], 255, shift=4)

    def cover_box(self, x: float, y: float, width: float, height: float) -> None:
        """Make a rectangle opaque [metres]."""
        self.cover((x, y), (x + width, y), (x + width, y + height), (x, y + height))

    def cover_round(self, x: float, y: float, half_width: float, half_height: float) -> None:
        """Make an ellipse opaque [metres]."""
        turn = np.linspace(0, 2 * np.pi, 97)[:-1]
        self.cover(*point_list(x + half_width * np.cos(turn), y + half_height * np.sin(turn)))

    def wheel(
        self, x: float, y: float, radius: float, tyre: ArrayLike, hub: float, cap: ArrayLike
    ) -> None:
        """Paint an opaque wheel with a hub [metres]."""
        self.painting.disc(x, y, radius, tyre)
        self.painting.disc(x, y, hub, cap)
        self.cover_round(x, y, radius, radius)

    def places(self) -> tuple[Array, Array]:
        """Return the relative column and row of the painted pixels, in [0, 1]."""
        height, width = self._coverage.shape
        across, down = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
        places = np.broadcast_arrays(across, down[:, None])
        return places[0], places[1]

    def light(self, gain: Array) -> None:
        """Multiply the colours by a gain that broadcasts to the shape of `places`."""
        picture = self.painting.picture
        _light(picture, np.broadcast_to(gain, picture.shape[:2]))

    def rounded(self, bright: float, fall: float, middle: float) -> None:
        """Shade the object like a pillar that is brightest at the relative column `middle` / 2."""
        across, _ = self.places()
        self.light(bright - fall * np.square(2 * across - middle))

    def wear(
        self, random: Generator, strength: float, coarsest: int, finest: int,
        stretch: int = 1, side: int = 256,
    ) -> None:  # fmt: skip
        """Add vertically stretched noise with `coarsest` to `finest` cells per `side` pixels."""
        grain = fractal(random, side, coarsest, finest, 0.75)
        rows, columns = (np.arange(size) for size in self._coverage.shape)
        self.light(1 + strength * grain[np.ix_(rows // stretch % side, columns % side)])

    def reduced(self) -> tuple[Array, Array]:
        """Return colour (h, w, 3) in [0, 255] and coverage (h, w) in [0, 1], in image pixels."""
        colour = cv2.resize(self.painting.picture, self._size, interpolation=cv2.INTER_AREA)
        coverage = cv2.resize(self._coverage, self._size, interpolation=cv2.INTER_AREA)
        return colour.astype(np.float64), coverage / 255


@njit(cache=True)
def _light(picture: NDArray[np.uint8], gain: Array) -> None:
    """Multiply an image by a gain (h, w) in place and round down to whole grey levels."""
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            for c in range(3):
                level = np.rint(picture[row, column, c] * gain[row, column])
                picture[row, column, c] = np.uint8(min(max(level, 0.0), 255.0))


class RigidObject:
    """Flat rigid object that moves, rotates, scales, and slowly changes between two textures.

    `textures` are one or two textures (h, w, 3), BGR in [0, 255]. `coverage`, shape (h, w), is in
    [0, 1]. `oversize` is the number of texture pixels per image pixel at scale 1.
    """

    def __init__(self, textures: Sequence[Array], coverage: Array, oversize: float) -> None:
        alpha = np.full((*coverage.shape, 1), 255.0)
        self._textures = []
        for texture in (textures[0], textures[-1]):
            image = np.concatenate([np.clip(texture, 0, 255), alpha], axis=2) * coverage[..., None]
            padded = np.pad(image, [(1, 1), (1, 1), (0, 0)])
            self._textures.append(np.round(padded).astype(np.uint8))
        self._silhouette = np.repeat(self._textures[0][..., 3:], 4, axis=2)
        self._oversize = oversize

    def draw(
        self, canvas: Image, places: Array, scale: float, angle: float, share: float = 0.0
    ) -> None:
        """Blend the object over a canvas, averaged over positions (k, 2) of its centre [pixels].

        The angle is clockwise [radians]. `share` in [0, 1] is the share of the second texture.
        """
        matrices = self._matrices(places, scale, angle)
        first, second = self._textures
        lay_mixture(canvas, first, second, round(256 * share), matrices)

    def coverage(
        self, size: tuple[int, int], place: Array, scale: float, angle: float
    ) -> NDArray[np.uint8]:
        """Return the object's coverage of each pixel of a canvas (width, height), in [0, 255]."""
        canvas = np.zeros((size[1], size[0], 3), np.uint8)
        matrices = self._matrices(place[None], scale, angle)
        lay_mixture(canvas, self._silhouette, self._silhouette, 0, matrices)
        return canvas[..., 0]

    def _matrices(self, places: Array, scale: float, angle: float) -> NDArray[np.int64]:
        """Return one map from canvas to texture pixels per position; see `lay_mixture`."""
        step = self._oversize / scale
        turn = step * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        middle = np.array(self._silhouette.shape[1::-1]) / 2 - 0.5
        shifts = middle - (places - 0.5) @ turn.T
        matrices = np.concatenate([np.tile(turn, (len(places), 1, 1)), shifts[..., None]], axis=2)
        return np.round(matrices * 65536).astype(np.int64)


@njit(cache=True)
def lay_mixture(
    canvas: NDArray[np.uint8],
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    share: int,
    matrices: NDArray[np.int64],
) -> None:
    """Blend a mixture of two textures over a canvas, averaged over positions, bilinear.

    `canvas`, shape (height, width, 3), is changed in place. `first` and `second`, shape (h, w, 4),
    are premultiplied by the coverage, which is the last channel and equal in both textures. They
    have a transparent border of one pixel. `share` in [0, 256] is the share of the second texture.
    `matrices`, shape (k, 2, 3), map column and row of the canvas to column and row of the textures,
    times 65536.
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
