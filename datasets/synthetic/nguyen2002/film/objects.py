"""Painted objects of a clip: static objects, carriers that hold the target, and occluders.

Static objects move in the image with a parallax that depends on their depth. The target is painted
over its carrier; the carrier does not belong to the target. Occluders pass in front of the target
and are painted at their size in the image.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.colours import sample_colour, vary_colour
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.texture import fractal, noise

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


def _prop(sheet: PaintedSheet, x: float, z: float, random: Generator) -> Prop:
    """Return a painted object that stands on the lower border of its sheet."""
    sheet.wear(random, 0.08, 4, 32, side=128)
    colour, coverage = sheet.reduced()
    return Prop(x, z, colour, coverage, float(len(coverage)))


def goods(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a heap of boxes and drums."""
    width, height = random.uniform(1.4, 2.6), random.uniform(0.8, 1.7)
    sheet = PaintedSheet(width, height, scale, sample_colour(random, WOODS))
    p = sheet.painting
    for left, wide in adjacent_spans(random, width, (0.5, 0.9), gap=0.02, rest=0.05):
        tall = random.uniform(0.5, 1) * height
        paint = sample_colour(random, WOODS + PAINTS)
        p.plate(left, height - tall, wide, tall, paint, 0.03)
        for y in np.arange(height - tall + 0.2, height, 0.3):
            p.darken(left, y, wide, 0.03, 0.7)
        p.label(random, left + 0.2 * wide, height - 0.8 * tall, 0.5 * wide, 0.2)
        sheet.cover_box(left, height - tall, wide, tall)
    return _prop(sheet, x, z, random)


def bollard(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return an iron bollard, or a mooring post with rings."""
    tall = random.uniform(0.6, 1.5)
    sheet = PaintedSheet(
        0.5, tall, scale, sample_colour(random, ((52, 54, 58), (60, 84, 104), (46, 50, 120)))
    )
    sheet.painting.patch(0, 0, 0.5, 0.16, sample_colour(random, LIGHTS))
    sheet.painting.patch(0, 0.3, 0.5, 0.12, sample_colour(random, LIGHTS))
    sheet.cover_box(0.1, 0.0, 0.3, tall)
    sheet.cover_box(0.0, tall - 0.12, 0.5, 0.12)
    sheet.rounded(1.15, 0.5, 0.8)
    return _prop(sheet, x, z, random)


def boat(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a small boat with a mast."""
    paint = sample_colour(random, PAINTS)
    sheet = PaintedSheet(3.4, 3.6, scale, paint)
    p = sheet.painting
    p.patch(0, 0, 3.4, 2.6, sample_colour(random, LIGHTS))
    p.patch(1.6, 0, 0.1, 2.6, (70, 90, 110))
    for left in (0.8, 1.4, 2.0):
        p.patch(left, 2.15, 0.4, 0.3, (76, 68, 60))
    p.patch(0, 2.72, 3.4, 0.14, sample_colour(random, LIGHTS))
    p.patch(0, 3.4, 3.4, 0.2, paint * 0.5)
    sheet.cover_box(0.7, 2.0, 1.9, 0.6)
    sheet.cover_box(1.6, 0.0, 0.09, 2.2)
    sheet.cover((0.0, 2.6), (3.4, 2.5), (3.1, 3.6), (0.4, 3.6))
    return _prop(sheet, x, z, random)


def column(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return an iron column that supports a roof, taller than the image."""
    wide, tall = random.uniform(0.24, 0.36), 8.0
    sheet = PaintedSheet(
        2 * wide, tall, scale, sample_colour(random, ((84, 104, 70), (92, 86, 80), PAINTS[0]))
    )
    for y in (tall - 1.1, tall - 3.2, tall - 3.5):
        sheet.painting.patch(0, y, 2 * wide, 0.12, sample_colour(random, LIGHTS))
    sheet.cover_box(wide / 2, 0, wide, tall)
    sheet.cover_box(0, tall - 0.4, 2 * wide, 0.4)
    sheet.rounded(1.15, 0.6, 0.8)
    return _prop(sheet, x, z, random)


def trolley(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return cases on a trolley."""
    width, height = 1.7, 1.5
    sheet = PaintedSheet(width, height, scale, (70, 74, 80))
    p, top = sheet.painting, height - 0.35
    for _ in range(int(random.integers(1, 4))):
        wide = random.uniform(0.8, 1.4)
        left = (width - wide) / 2 + random.uniform(-0.12, 0.12)
        tall = random.uniform(0.25, 0.4)
        top -= tall
        paint = sample_colour(random, WOODS + PAINTS)
        p.plate(left, top, wide, tall, paint, 0.03)
        p.patch(left + 0.2 * wide, top, 0.08, tall, paint * 0.5)
        p.patch(left + 0.7 * wide, top, 0.08, tall, paint * 0.5)
        sheet.cover_box(left, top, wide, tall)
    sheet.cover_box(0.1, height - 0.35, 1.5, 0.1)
    for wheel_x in (0.4, 1.3):
        p.disc(wheel_x, height - 0.14, 0.14, (40, 40, 42))
        sheet.cover_round(wheel_x, height - 0.14, 0.14, 0.14)
    return _prop(sheet, x, z, random)


def stall(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a market stall: striped awning, lamps, heaps of fruit."""
    width, height = random.uniform(2.4, 3.4), 2.7
    sheet = PaintedSheet(width, height, scale, (70, 84, 100))
    p = sheet.painting
    first, second = sample_colour(random, PAINTS), sample_colour(random, LIGHTS)
    stripes = int(random.integers(6, 10))
    for k in range(stripes):
        p.patch(k * width / stripes, 0, width / stripes, 0.75, first if k % 2 else second)
    p.darken(0, 0.62, width, 0.13, 0.75)
    p.patch(0, 0.75, width, 1.0, (48, 58, 70))
    for lamp_x in np.arange(0.2, width, 0.4):
        p.patch(lamp_x, 0.8, 0.22, random.uniform(0.2, 0.7), sample_colour(random, PAINTS))
    counter = 1.72
    for left, wide in adjacent_spans(random, width, (0.5, 0.9), rest=0.1):
        fruit = sample_colour(random, PAINTS[:5])
        for _ in range(26):
            place = left + random.uniform(0.05, wide - 0.05), counter + random.uniform(0, 0.2)
            p.disc(*place, 0.075, fruit * random.uniform(0.7, 1.2))
    p.plate(0, 1.95, width, 0.8, sample_colour(random, WOODS), 0.04)
    for lamp_x in np.arange(0, width, 0.35):
        p.darken(lamp_x, 1.95, 0.03, 0.8, 0.6)
    sheet.cover((0.15, 0.0), (width - 0.15, 0.0), (width, 0.75), (0.0, 0.75))
    sheet.cover_box(0.1, 0.7, width - 0.2, height - 0.7)
    return _prop(sheet, x, z, random)


def rock(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a boulder with cracks."""
    width, height = random.uniform(0.8, 2.4), random.uniform(0.4, 1.1)
    sheet = PaintedSheet(
        width, height, scale, sample_colour(random, ((92, 128, 164), (108, 136, 158)))
    )
    turn = np.linspace(np.pi, 2 * np.pi, 12)
    far = random.uniform(0.75, 1.0, 12)
    along = (0.5 + 0.5 * far * np.cos(turn)) * width
    up = height * (1 + far * np.sin(turn))
    sheet.cover(*point_list(along, up))
    _, down = sheet.places()
    sheet.light(1.2 - 0.6 * down)
    sheet.wear(random, 0.25, 8, 64, side=128)
    return _prop(sheet, x, z, random)


# column and row of the centre, width and height of a target [UNIT]
Place = tuple[float, float, float, float]

STEEL, TYRE = (96, 98, 100), (36, 34, 34)  # colours of carriers, BGR
SHADE = (24.0, 22.0, 20.0)  # colour of shadows, BGR


def paint_carrier(random: Generator, kind: str, width: float, height: float) -> PaintedSheet:
    """Paint the object in `CARRIERS` that carries a target of this width and height [pixels]."""
    w, h = width / UNIT, height / UNIT
    across, down = 2.6 * w, 6.0 * h
    sheet = PaintedSheet(across, down, UNIT, STEEL)
    CARRIERS[kind].paint(random, sheet, (across / 2, down / 2, w, h))
    sheet.wear(random, 0.08, 8, 64)
    return sheet


def paint_shadow(width: float, darkness: float) -> tuple[Array, Array]:
    """Return a soft shadow on the ground: colour (h, w, 3) and coverage (h, w).

    `width` is the width of the shadow [pixels], `darkness` its coverage in the centre, in [0, 1].
    """
    columns, rows = round(width), max(round(0.2 * width), 3)
    across = np.linspace(-1, 1, columns)
    down = np.linspace(-1, 1, rows)[:, None]
    inside = np.clip(1.6 * (1 - np.sqrt(across * across + down * down)), 0, 1)
    return np.full((rows, columns, 3), SHADE), darkness * inside


def _wheels(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    """Paint nothing, because the wheels of a van are part of the target."""


def _car(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    """Paint the back of an off-road car whose spare wheel is the target."""
    (x, y, w, h), p = place, sheet.painting
    paint = sample_colour(random, PAINTS[5:] + LIGHTS[:2])
    left, top, low = x - 0.85 * w, y - 0.9 * h, y + 0.72 * h
    p.patch(left, top, 1.7 * w, low - top, paint)
    p.hole(left + 0.12 * w, top + 0.08 * h, 1.46 * w, 0.45 * h, np.array([84.0, 78.0, 70.0]))
    for side in (left + 0.05 * w, left + 1.5 * w):
        p.patch(side, y + 0.3 * h, 0.15 * w, 0.2 * h, (52, 52, 170))
    p.plate(left, low - 0.16 * h, 1.7 * w, 0.16 * h, STEEL, 0.01)
    sheet.cover((left + 0.14 * w, top), (left + 1.56 * w, top), (left + 1.7 * w, y - 0.3 * h),
                (left + 1.7 * w, low), (left, low), (left, y - 0.3 * h))  # fmt: skip
    for wheel in (left + 0.06 * w, left + 1.34 * w):
        p.patch(wheel, low, 0.3 * w, 0.28 * h, TYRE)
        sheet.cover_box(wheel, low, 0.3 * w, 0.25 * h)


def _rider(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    """Paint a motorcyclist from behind, without the helmet, which is the target."""
    (x, y, w, h), p = place, sheet.painting
    jacket = sample_colour(random, PAINTS[5:] + ((50, 48, 48), (66, 60, 56)))
    shape = [(x - 0.3 * w, y + 0.3 * h), (x + 0.3 * w, y + 0.3 * h), (x + 0.85 * w, y + 0.62 * h),
             (x + 1.1 * w, y + 1.3 * h), (x + 0.8 * w, y + 1.5 * h), (x + 0.62 * w, y + 2.9 * h),
             (x - 0.62 * w, y + 2.9 * h), (x - 0.8 * w, y + 1.5 * h), (x - 1.1 * w, y + 1.3 * h),
             (x - 0.85 * w, y + 0.62 * h)]  # fmt: skip
    p.area(shape, jacket)
    sheet.cover(*shape)
    for side in (-1, 1):
        p.line([(x + side * 0.4 * w, y + 0.5 * h), (x + side * 0.6 * w, y + 1.4 * h)], 0.05,
               jacket * 0.6)  # fmt: skip
    p.patch(x - 0.5 * w, y + 0.86 * h, w, 0.1 * h, sample_colour(random, PAINTS[:5]))
    p.line([(x, y + 0.5 * h), (x, y + 2.5 * h)], 0.02, jacket * 0.5)


def _trailer(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    (x, y, w, h), p = place, sheet.painting
    thick, deck = 0.07 * w, y + 0.86 * h
    p.patch(x - thick, y, 2 * thick, h, STEEL)
    p.patch(x - 0.5 * thick, y, 0.5 * thick, h, (150, 152, 152))
    sheet.cover_box(x - thick, y, 2 * thick, 0.9 * h)
    p.plate(x - 0.75 * w, deck, 1.5 * w, 0.12 * h, sample_colour(random, PAINTS), 0.01)
    sheet.cover_box(x - 0.75 * w, deck, 1.5 * w, 0.12 * h)
    for side in (-0.5, 0.5):
        sheet.wheel(x + side * w, y + 0.98 * h, 0.12 * h, TYRE, 0.05 * h, STEEL)


def _ropes(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    (x, y, w, h), p = place, sheet.painting
    p.patch(0, 0, 2.6 * w, 3 * h, (70, 92, 106))
    for side in (-0.42, 0.42):
        rope_x = x + side * w
        sheet.cover((rope_x - 0.012, y - 0.3 * h), (rope_x + 0.012, y - 0.3 * h),
                    (x + 0.012, y - 1.1 * h), (x - 0.012, y - 1.1 * h))  # fmt: skip
    sheet.cover_box(x - 0.014, 0, 0.028, y - h)


def _cart(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    (x, y, w, h), p = place, sheet.painting
    left, top = x - 0.66 * w, y + 0.47 * h
    p.patch(left, top, 1.32 * w, 0.12 * h, sample_colour(random, PAINTS))
    p.patch(left, top + 0.08 * h, 1.32 * w, 0.05 * h, (50, 52, 56))
    sheet.cover_box(left, top, 1.32 * w, 0.13 * h)
    for wheel_x in (left + 0.22 * w, left + 1.1 * w):
        sheet.wheel(wheel_x, y + 0.68 * h, 0.12 * h, TYRE, 0.05 * h, STEEL)
    rail = left + 1.28 * w
    sheet.cover_box(rail, y - 0.3 * h, 0.04 * w, 0.8 * h)


def _water(random: Generator, sheet: PaintedSheet, place: Place) -> None:
    (x, y, w, h), p = place, sheet.painting
    line = y + 0.46 * h
    p.patch(0, y, 2.6 * w, 3 * h, (206, 204, 190))
    sheet.cover_round(x, line, 0.6 * w, 0.06 * h)
    for along in np.linspace(0, 1, 60):
        far, side = along**1.4, float(random.choice([-1.0, 1.0]))
        across = x + side * (0.42 + 0.8 * far) * w + random.normal(0, 0.04) * w
        down = line + 0.34 * far * h + random.normal(0, 0.02) * h
        sheet.cover_round(across, down, (0.11 - 0.07 * far) * w, (0.022 - 0.01 * far) * h)


@dataclass(frozen=True)
class Carrier:
    """Kind of carrier: how it is painted, and how high the target is above the ground."""

    paint: Callable[[Generator, PaintedSheet, Place], None]
    # distance from the target's centre down to the ground [target heights]; 0: ground not visible
    drop: float
    # width of the shadow on the ground, or of the reflection in water [target widths]
    shadow: float


# carriers by name
CARRIERS = {
    "wheels": Carrier(_wheels, 0.5, 1.25),
    "car": Carrier(_car, 0.97, 2.0),
    "rider": Carrier(_rider, 0.0, 0.0),
    "trailer": Carrier(_trailer, 1.1, 1.7),
    "ropes": Carrier(_ropes, 0.95, 1.2),
    "cart": Carrier(_cart, 0.8, 1.6),
    "water": Carrier(_water, 0.48, 1.1),
}


WALLS = ((84, 98, 150), (120, 150, 176), (150, 158, 164), (104, 122, 142), (170, 186, 192))
STONES = ((150, 158, 164), (128, 146, 160), (108, 114, 118), (164, 176, 186))
COATS = ((52, 48, 46), (84, 74, 60), (70, 92, 120), (58, 70, 52), (60, 50, 96), (120, 132, 140))


@dataclass(frozen=True)
class Occluder:
    """Kind of object that passes in front of the target."""

    # function of a generator, width and height [UNIT]; paints an object that hides this area
    paint: Callable[[Generator, float, float], PaintedSheet]
    fixed: bool  # True if the object is static and passes only because the camera moves
    tall: bool  # True if the object extends beyond the upper and the lower image border
    # True if the object stands on the ground on wheels, nearer to the camera than the target
    stands: bool = False


def _pillar(random: Generator, width: float, height: float) -> PaintedSheet:
    sheet = PaintedSheet(width, height, UNIT, sample_colour(random, STONES + PAINTS[6:8]))
    p = sheet.painting
    for y in np.arange(random.uniform(0, 0.4), height, random.uniform(0.5, 0.9)):
        p.darken(0, y, width, 0.018, 0.6)
    if random.random() < 0.7:
        x, y = random.uniform(0.1, 0.3) * width, random.uniform(0.6, 1.3)
        p.patch(x, y, 0.5 * width, 0.62 * width, sample_colour(random, LIGHTS))
        p.patch(x + 0.05 * width, y + 0.05 * width, 0.4 * width, 0.3 * width,
                sample_colour(random, PAINTS))  # fmt: skip
        p.label(random, x, y + 0.38 * width, 0.5 * width, 0.22 * width)
    sheet.cover_box(0, 0, width, height)
    across, _ = sheet.places()
    side = 2 * across - 1 + random.choice([-0.3, 0.3])
    sheet.light(1.1 - 0.5 * np.clip(side * side, 0, 1))
    sheet.wear(random, 0.1, 4, 128)
    return sheet


def _trunk(random: Generator, width: float, height: float) -> PaintedSheet:
    """Paint a thick trunk with bark; it is at least `width` wide everywhere."""
    bulge = 0.12 * width
    sheet = PaintedSheet(
        width + 2 * bulge, height, UNIT, sample_colour(random, ((58, 76, 92), (72, 82, 90)))
    )
    edges = [bulge * (0.5 + 0.45 * np.clip(noise(random, 256, 8)[0, ::8], -1, 1)) for _ in "lr"]
    rows = np.linspace(0, height, len(edges[0]))
    left, right = point_list(bulge - edges[0], rows), point_list(width + bulge + edges[1], rows)
    sheet.cover(*left, *right[::-1])
    sheet.wear(random, 0.3, 16, 64, stretch=5)
    sheet.wear(random, 0.1, 4, 32)
    sheet.rounded(1.12, 0.55, 0.8)
    return sheet


def _wall_end(random: Generator, width: float, height: float) -> PaintedSheet:
    colour = sample_colour(random, WALLS)
    sheet = PaintedSheet(width, height, UNIT, colour * 0.72)
    p, course = sheet.painting, random.uniform(0.1, 0.16)
    for k, y in enumerate(np.arange(0, height, course)):
        x = -random.uniform(0.4, 0.6) * course * (k % 2) * 2
        while x < width:
            p.patch(x, y, 2.2 * course - 0.014, course - 0.014, vary_colour(random, colour, 0.12))
            x += 2.2 * course
    if random.random() < 0.7:
        y = random.uniform(0.7, 1.4)
        p.plate(0.15 * width, y, 0.66 * width, 0.4 * width, sample_colour(random, PAINTS), 0.012)
        p.patch(
            0.22 * width, y + 0.1 * width, 0.5 * width, 0.07 * width, sample_colour(random, LIGHTS)
        )
        p.patch(
            0.22 * width,
            y + 0.23 * width,
            0.36 * width,
            0.05 * width,
            sample_colour(random, LIGHTS),
        )
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.12, 4, 128)
    return sheet


def _lorry(random: Generator, width: float, height: float) -> PaintedSheet:
    sheet = PaintedSheet(width, height + 0.34, UNIT, sample_colour(random, PAINTS))
    p = sheet.painting
    second = sample_colour(random, LIGHTS if random.random() < 0.6 else PAINTS)
    p.patch(0, random.uniform(0.3, 0.6) * height, width, random.uniform(0.1, 0.2) * height, second)
    for x in np.arange(0.1, width, random.uniform(0.22, 0.34)):
        p.darken(x, 0, 0.05, height, 0.86)
        p.darken(x + 0.05, 0, 0.03, height, 1.1)
    for x in np.arange(0.2 * width, 0.72 * width, 0.13 * width):
        p.patch(x, 0.2 * height, 0.03 * width, 0.16 * height, second)
        p.patch(x, random.choice([0.2, 0.27, 0.33]) * height, 0.09 * width, 0.03 * height, second)
    sheet.anchor = width / 2, height / 2
    p.patch(0, height - 0.09, width, 0.09, (52, 52, 54))
    for x in (0.22 * width, 0.76 * width):
        sheet.wheel(x, height + 0.14, 0.2, (34, 32, 32), 0.1, (120, 122, 124))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.09, 4, 64)
    return sheet


def _bus(random: Generator, width: float, height: float) -> PaintedSheet:
    body = sample_colour(random, PAINTS)
    sheet = PaintedSheet(width, height + 0.3, UNIT, body)
    sheet.anchor = width / 2, height / 2
    p, second = sheet.painting, sample_colour(random, LIGHTS)
    p.patch(0, 0, width, 0.08 * height, second)
    p.patch(0, 0.54 * height, width, 0.07 * height, second)
    pitch = random.uniform(0.3, 0.4)
    for x in np.arange(0.05, width - 0.1, pitch):
        wide = min(pitch - 0.06, width - x - 0.04)
        glass = vary_colour(random, (112, 98, 84), 0.3)
        p.hole(x, 0.14 * height, wide, 0.34 * height, glass)
        p.area([(x + 0.3 * wide, 0.15 * height), (x + 0.6 * wide, 0.15 * height),
                (x + 0.3 * wide, 0.48 * height), (x, 0.48 * height)], glass + 40)  # fmt: skip
        p.darken(x - 0.03, 0.62 * height, 0.012, 0.34 * height, 0.6)
    for x in (0.25 * width, 0.75 * width):
        sheet.wheel(x, height + 0.08, 0.19, (36, 34, 34), 0.09, (150, 150, 150))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.05, 4, 64)
    return sheet


def _container(random: Generator, width: float, height: float) -> PaintedSheet:
    colour = sample_colour(random, PAINTS)
    sheet = PaintedSheet(width, height + 0.34, UNIT, colour)
    sheet.anchor = width / 2, height / 2
    p, pitch = sheet.painting, random.uniform(0.07, 0.11)
    for x in np.arange(0, width, pitch):
        p.darken(x, 0, 0.4 * pitch, height, 0.74)
        p.darken(x + 0.4 * pitch, 0, 0.2 * pitch, height, 1.14)
    for _ in range(7):
        x, y = random.uniform(0, width), random.uniform(0, 0.6) * height
        p.patch(x, y, random.uniform(0.01, 0.04), random.uniform(0.1, 0.3), (40, 66, 108))
    for y in (0.0, height - 0.07):
        p.plate(0, y, width, 0.07, colour * 0.8, 0.02)
    for x in np.arange(0.5 * width, 0.9 * width, 0.08 * width):
        p.patch(x, 0.2 * height, 0.05 * width, random.uniform(0.06, 0.12) * height, LIGHTS[0])
    for x in (0.14 * width, 0.3 * width, 0.84 * width):
        sheet.wheel(x, height + 0.14, 0.2, (34, 32, 32), 0.1, (120, 122, 124))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.08, 4, 64)
    return sheet


def _ship(random: Generator, width: float, height: float) -> PaintedSheet:
    colour = sample_colour(random, PAINTS)
    rail, draught = 0.16, 0.3
    sheet = PaintedSheet(width, rail + height + draught, UNIT, colour)
    sheet.anchor = width / 2, rail + height / 2
    p = sheet.painting
    p.patch(0, 0, width, rail, sample_colour(random, LIGHTS))
    p.plate(0, rail, width, 0.07, sample_colour(random, LIGHTS), 0.012)
    for y in np.arange(rail + 0.2, rail + height, 0.22):
        p.darken(0, y, width, 0.012, 0.7)
    for x in np.arange(0.14, width - 0.05, random.uniform(0.2, 0.3)):
        p.disc(x, rail + 0.26 * height, 0.055, colour * 0.6)
        p.disc(x, rail + 0.26 * height, 0.036, (92, 84, 76))
        p.patch(x + 0.05, rail + 0.6 * height, 0.025, random.uniform(0.1, 0.3), (40, 66, 108))
    p.patch(0, rail + height, width, draught, (48, 50, 110))
    p.patch(0, rail + height + 0.22, width, draught, (196, 192, 178))
    for x in np.arange(0.0, width, 0.12):
        sheet.cover_box(x, 0, 0.014, rail)
    sheet.cover_box(0, 0, width, 0.02)
    sheet.cover_box(0, rail, width, height + draught)
    sheet.wear(random, 0.1, 4, 64)
    return sheet


def _load(random: Generator, width: float, height: float) -> PaintedSheet:
    ropes = 1.9
    sheet = PaintedSheet(width, ropes + height, UNIT, (90, 110, 130))
    sheet.anchor = width / 2, ropes + height / 2
    p = sheet.painting
    rows = int(random.integers(2, 4))
    for row in range(rows):
        for x, wide in adjacent_spans(random, width, (0.22, 0.45)):
            wood = sample_colour(random, WOODS + PAINTS[6:10])
            p.plate(x, ropes + row * height / rows, wide, height / rows, wood, 0.016)
            p.label(random, x + 0.2 * wide, ropes + (row + 0.3) * height / rows, 0.5 * wide,
                    0.3 * height / rows)  # fmt: skip
    p.patch(0, ropes + height - 0.07, width, 0.07, (54, 84, 116))
    sheet.cover_box(0, ropes, width, height)
    for side in (0.03 * width, 0.97 * width):
        rope = [(side - 0.012, ropes + 0.02), (0.5 * width - 0.012, 0), (0.5 * width + 0.012, 0),
                (side + 0.012, ropes + 0.02)]  # fmt: skip
        p.area(rope, (70, 74, 78))
        sheet.cover(*rope)
    sheet.wear(random, 0.07, 4, 64)
    return sheet


def _passer_by(random: Generator, width: float, height: float) -> PaintedSheet:
    """Paint the back of a person in a long coat, close to the camera.

    `width` is the width of the coat. The shoulders are at least as high as the top of the target.
    """
    head = 0.62 * width
    cloth = sample_colour(random, COATS)
    neck = 0.05 + 1.35 * head
    side, tall = width + 0.3, neck + 0.15 + height + 1.6
    sheet = PaintedSheet(side, tall, UNIT, cloth)
    sheet.anchor = side / 2, neck + 0.15 + height / 2
    p, middle = sheet.painting, side / 2
    p.patch(0, 0, side, neck, sample_colour(random, ((40, 44, 52), (60, 84, 112), (110, 120, 128))))
    p.patch(0, neck - 0.35 * head, side, 0.35 * head + 0.02, (128, 152, 196))
    folds = [(0.2, 0.78), (0.42, 1.16), (0.55, 0.7), (0.7, 1.1), (0.86, 0.8)]
    for place, gain in folds:
        x = middle + (place - 0.5) * width + random.uniform(-0.04, 0.04)
        p.darken(x, neck + 0.25, 0.05, tall, gain)
    p.darken(middle - 0.006, neck + 0.1, 0.012, tall, 0.5)
    p.area([(middle - 0.3 * head, neck - 0.06), (middle + 0.3 * head, neck - 0.06),
            (middle + 0.5 * head, neck + 0.12), (middle - 0.5 * head, neck + 0.12)],
           cloth * 0.7)  # fmt: skip
    sheet.cover_round(middle, 0.05 + 0.62 * head, 0.42 * head, 0.6 * head)
    half = width / 2
    sheet.cover((middle - 0.2 * head, 0.9 * head), (middle + 0.2 * head, 0.9 * head),
                (middle + 0.24 * head, neck), (middle + 0.8 * half, neck + 0.04),
                (middle + half, neck + 0.15), (middle + half + 0.1, tall),
                (middle - half - 0.1, tall), (middle - half, neck + 0.15),
                (middle - 0.8 * half, neck + 0.04), (middle - 0.24 * head, neck))  # fmt: skip
    sheet.rounded(1.08, 0.35, 0.85)
    sheet.wear(random, 0.1, 8, 128)
    return sheet


def _post(random: Generator, width: float, height: float) -> PaintedSheet:
    sheet = PaintedSheet(
        width, height, UNIT, sample_colour(random, ((70, 74, 76), (60, 84, 64), WOODS[2]))
    )
    if random.random() < 0.5:
        for y in np.arange(0.2, height, 0.5):
            sheet.painting.patch(0, y, width, 0.25, (60, 70, 190))
    sheet.cover_box(0, 0, width, height)
    sheet.rounded(1.15, 0.6, 0.8)
    sheet.wear(random, 0.08, 8, 64)
    return sheet


def _heap(random: Generator, width: float, height: float) -> PaintedSheet:
    sheet = PaintedSheet(width, height, UNIT, (70, 88, 104))
    for x, wide in adjacent_spans(random, width, (0.2, 0.4)):
        y = random.uniform(0.0, 0.07)
        sheet.cover_box(x, y, wide, height)
        while y < height:
            tall = random.uniform(0.2, 0.45)
            sheet.painting.plate(x, y, wide, tall, sample_colour(random, WOODS + PAINTS), 0.012)
            sheet.painting.label(random, x + 0.2 * wide, y + 0.06, 0.5 * wide, 0.1)
            y += tall
    sheet.wear(random, 0.08, 4, 64)
    return sheet


# occluders by name; the last two occlude only a part of the target
OCCLUDERS = {
    "pillar": Occluder(_pillar, True, True),
    "trunk": Occluder(_trunk, True, True),
    "wall end": Occluder(_wall_end, True, True),
    "lorry": Occluder(_lorry, False, False, True),
    "bus": Occluder(_bus, False, False, True),
    "container": Occluder(_container, False, False, True),
    "ship": Occluder(_ship, False, False),
    "load": Occluder(_load, False, False),
    "passer-by": Occluder(_passer_by, False, False),
    "post": Occluder(_post, True, True),
    "heap": Occluder(_heap, False, False),
}
