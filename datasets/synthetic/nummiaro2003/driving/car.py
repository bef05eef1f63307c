"""Cars: textures, rendering at a position, and paints that differ from the target's.

Textures are views of a car from the sides and from above, drawn to scale in metres. Facets are
rasterised in perspective, from front to back, in compiled kernels. A pixel has 4 x 4 samples. The
first facet that covers a sample occupies it. Therefore edges are smooth, adjacent facets leave no
gap, and hidden facets are not painted. Corners are rounded to 1/64 pixel; all pixel arithmetic uses
integers. `lay_facets` is one long kernel, because its inner loop uses some thirty numbers that a
called kernel would need as arguments.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    BELT,
    FRONT,
    MAX_CORNERS,
    NEAREST_DRAWN,
    OVERCAST,
    REACH,
    REAR,
    SHADOW,
    SIDE,
    SIZES,
    TALL,
    TOP,
    TYRE,
    WIDE,
    CarShape,
    FacetPose,
    Facets,
    Lens,
    Light,
    PerspectiveView,
    Pictures,
    Window,
    blank_pictures,
    facet_extents,
    facet_pose,
    pack_pictures,
    sample_car_shape,
)
from trackmark.datasets.synthetic.render.prop import Coverage
from trackmark.datasets.synthetic.render.sprite import blend_sprite

FULL = 0xFFFF  # all samples of a pixel are occupied
NEAR = 0.3  # minimum depth of drawn points [metres]
_RUN = 16  # pixels between two exact perspective divisions
_ONE = 65536.0  # fixed-point steps per texture pixel

# Unsigned, so that compiled code does not check indices for negative values.
OUTER, INNER, LOWEST = np.uint64(0xFF00FF), np.uint64(0x00FF00), np.uint64(0xFF)
EIGHT, FIFTEEN, SIXTEEN = np.uint64(8), np.uint64(15), np.uint64(16)
TWENTY_FOUR = np.uint64(24)


@njit(cache=True)
def _count_samples(bits: np.int64) -> np.int64:
    """Count the bits that are set among the 16 samples of a pixel."""
    bits = (bits & 0x5555) + ((bits >> 1) & 0x5555)
    bits = (bits & 0x3333) + ((bits >> 2) & 0x3333)
    bits = (bits & 0x0F0F) + ((bits >> 4) & 0x0F0F)
    return (bits & 0xFF) + (bits >> 8)


@njit(cache=True)
def _clip_polygon(points: Array, count: int, result: Array) -> int:
    """Clip a polygon to depths above NEAR, into `result`; return the number of its corners."""
    n_corners = 0
    for k in range(count):
        a, b = points[k], points[(k + 1) % count]
        if a[2] >= NEAR:
            for i in range(3):
                result[n_corners, i] = a[i]
            n_corners += 1
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            share = (NEAR - a[2]) / (b[2] - a[2])
            for i in range(3):
                result[n_corners, i] = a[i] + (b[i] - a[i]) * share
            n_corners += 1
    return n_corners


@njit(cache=True)
def _start_edges(
    edges: NDArray[np.int64], count: int, first: int, walks: NDArray[np.int64]
) -> None:
    """Initialise the edges of a polygon for a traversal of the sample lines.

    Columns of `walks`: the bound [samples] and its remainder, the steps of both per line, the
    divisor of the remainder, and the kind of bound. The kind is 1 for a left bound, -1 for a right
    bound, and 0 for a horizontal edge, of which only the sign of the bound counts.
    """
    for k in range(count):
        a = edges[k, 0]
        begin = edges[k, 1] * (64 * first + 8) + edges[k, 2] + 8 * a
        unit = max(16 * abs(a), 1)
        step = 16 * edges[k, 1]
        walks[k, 0], walks[k, 1] = begin // unit, begin % unit
        walks[k, 2], walks[k, 3] = step // unit, step % unit
        walks[k, 4], walks[k, 5] = unit, np.sign(a)


@njit(cache=True)
def _spans(walks: NDArray[np.int64], count: int, width: int, spans: NDArray[np.int64]) -> None:
    """Write the sample range of the four lines of a row into `spans`, and advance `walks`."""
    for line in range(4):
        low, high = 0, 4 * width - 1
        for k in range(count):
            bound, side = walks[k, 0], walks[k, 5]
            if side > 0:
                low = max(low, -bound)
            elif side < 0:
                high = min(high, bound)
            elif bound < 0:
                high = -1
            walks[k, 0] = bound + walks[k, 2]
            walks[k, 1] += walks[k, 3]
            if walks[k, 1] >= walks[k, 4]:
                walks[k, 1] -= walks[k, 4]
                walks[k, 0] += 1
        spans[line, 0], spans[line, 1] = low, max(high + 1, low)


@njit(cache=True)
def _samples(spans: NDArray[np.int64], x: int) -> int:
    """Return the samples of a pixel that lie within the spans of its row, as bits."""
    bits = 0
    for line in range(4):
        low = max(spans[line, 0] - 4 * x, 0)
        high = min(spans[line, 1] - 4 * x, 4)
        if low < high:
            bits |= ((1 << high) - (1 << low)) << (4 * line)
    return bits


@njit(cache=True)
def _level(
    du: int, dv: int, u: int, v: int, fall_u: float, fall_v: float, fall: float, deepest: int
) -> int:
    """Return the resolution level of a texture, from the texture area that a pixel covers.

    Texture coordinates in perspective are quotients; their numerators and denominator are linear in
    column and row. `du` and `dv` are the steps of the coordinates per column. `fall_u` and `fall_v`
    are the steps of the numerators per row, and `fall` is the step of the denominator. These three
    are divided by the denominator.
    """
    right = max(abs(du), abs(dv), 16384) / _ONE
    down = max(abs(fall_u - u / _ONE * fall), abs(fall_v - v / _ONE * fall), 0.25)
    area, level = right * down, 0
    while area > 2.0 and level < deepest:
        area *= 0.25
        level += 1
    return level


@njit(cache=True, error_model="numpy")
def lay_facets(
    canvas: NDArray[np.uint8],
    occupied: NDArray[np.uint16],
    shadow: NDArray[np.uint8],
    facets: Facets,
    pictures: Pictures,
    shade: Pictures,
    lens: Lens,
    pose: FacetPose,
    order: NDArray[np.int64],
) -> None:
    """Paint facets behind the existing content; `order` lists them from front to back.

    The function changes three arrays. `canvas` (height, width, 3) contains the sums over the
    occupied samples, divided by 16. `occupied` (height, width) has one bit per sample. `shadow`
    (height, width) is the darkness of soft facets on free samples; it remains unchanged if no
    facet is soft. `shade` is one texture for all facets; its blue channel is light times 128.
    """
    height, width = occupied.shape
    turn, place, focal = pose.turn, pose.place, lens.focal
    normal, factors = np.empty(3), np.empty(3)
    points, clipped = np.empty((MAX_CORNERS, 3)), np.empty((2 * MAX_CORNERS, 3))
    corners = np.empty((2 * MAX_CORNERS, 2), np.int64)
    edges, spans = np.empty((2 * MAX_CORNERS, 3), np.int64), np.empty((4, 2), np.int64)
    walks = np.empty((2 * MAX_CORNERS, 6), np.int64)
    slope, start_texel, end_texel = np.empty((5, 3)), np.empty(4, np.int64), np.empty(4, np.int64)
    for f in order:
        count = facets.counts[f]
        distance = 0.0
        for i in range(3):
            normal[i] = 0.0
            for j in range(3):
                normal[i] += turn[i, j] * facets.normals[f, j]
            for k in range(count):
                value = place[i]
                for j in range(3):
                    value += turn[i, j] * facets.corners[f, k, j]
                points[k, i] = value
            distance += normal[i] * points[0, i]
        if distance > -1e-6:
            continue  # back face
        count = _clip_polygon(points, count, clipped)
        if count < 3:
            continue
        area = 0
        for k in range(count):
            corners[k, 0] = np.floor(
                64 * (lens.column + focal * clipped[k, 0] / clipped[k, 2]) + 0.5
            )
            corners[k, 1] = np.floor(64 * (lens.row + focal * clipped[k, 1] / clipped[k, 2]) + 0.5)
        for k in range(count):
            after = (k + 1) % count
            area += corners[k, 0] * corners[after, 1] - corners[after, 0] * corners[k, 1]
        if area == 0 or corners[:count, 0].max() < 0 or corners[:count, 0].min() > 64 * width:
            continue
        sign = 1 if area > 0 else -1
        for k in range(count):
            after = (k + 1) % count
            dx, dy = corners[after, 0] - corners[k, 0], corners[after, 1] - corners[k, 1]
            edges[k, 0], edges[k, 1] = -sign * dy, sign * dx
            edges[k, 2] = sign * (dy * corners[k, 0] - dx * corners[k, 1])
        # Rows of `slope`: the numerators of four texture coordinates and their common
        # denominator, each linear in column and row.
        for i in range(5):
            constant = 0.0
            for j in range(3):
                if i < 2:
                    factors[j] = 0.0
                    for k in range(3):
                        factors[j] += turn[j, k] * facets.places[f, i, k]
                    constant -= factors[j] * place[j]
                elif i < 4:
                    factors[j] = pose.shading[i - 2, j]
                else:
                    factors[j] = 0.0
            if i < 2:
                constant += facets.places[f, i, 3]
            elif i < 4:
                constant = pose.shading[i - 2, 3]
            else:
                constant = 1.0
            for j in range(3):
                slope[i, j] = -distance * factors[j] - constant * normal[j]
            slope[i, 0] /= focal
            slope[i, 1] /= focal
            slope[i, 2] -= slope[i, 0] * (lens.column - 0.5) + slope[i, 1] * (lens.row - 0.5)
        nearest, farthest = clipped[:count, 2].min(), clipped[:count, 2].max()
        smallest, largest = -distance / farthest, -distance / nearest
        kind, gain, soft = facets.kinds[f], pose.gains[f], facets.soft[f]
        log_width, log_height = pictures.sizes[kind]
        deepest, deepest_shade = min(log_width, log_height), shade.sizes[0].min()
        first = max(corners[:count, 1].min() >> 6, 0)
        last = min((corners[:count, 1].max() >> 6) + 1, height)
        bits_s, bits_t = shade.sizes[0]
        # A facet whose depth is constant along rows needs one division per row.
        longest = width if slope[4, 0] == 0 else _RUN
        _start_edges(edges, count, first, walks)
        for y in range(first, last):
            _spans(walks, count, width, spans)
            start, end = spans[:, 0].min() >> 2, (spans[:, 1].max() + 3) >> 2
            solid, solid_end = (spans[:, 0].max() + 3) >> 2, spans[:, 1].min() >> 2
            used, out = occupied[y], canvas[y]
            while start < end and used[start] == FULL:
                start += 1
            while start < end and used[end - 1] == FULL:
                end -= 1
            for side in range(start, end, longest):
                run = min(longest, end - side)
                for x, texel in ((side, start_texel), (side + run, end_texel)):
                    below = slope[4, 0] * x + slope[4, 1] * y + slope[4, 2]
                    below = min(max(below, smallest), largest)
                    for i in range(4):
                        value = (slope[i, 0] * x + slope[i, 1] * y + slope[i, 2]) / below
                        texel[i] = np.int64(np.floor(value * _ONE))
                u, v, s, t = start_texel[0], start_texel[1], start_texel[2], start_texel[3]
                du, dv = (end_texel[0] - u) // run, (end_texel[1] - v) // run
                ds, dt = (end_texel[2] - s) // run, (end_texel[3] - t) // run
                over = 1.0 / below
                fall = slope[4, 1] * over
                level = _level(du, dv, u, v, slope[0, 1] * over, slope[1, 1] * over, fall, deepest)
                coarse = _level(
                    ds, dt, s, t, slope[2, 1] * over, slope[3, 1] * over, fall, deepest_shade
                )
                u, v, du, dv = (u >> level) - 32768, (v >> level) - 32768, du >> level, dv >> level
                s, t, ds, dt = s >> coarse, t >> coarse, ds >> coarse, dt >> coarse
                base, base_shade = pictures.starts[kind, level], shade.starts[0, coarse]
                across, across_shade = log_width - level, bits_s - coarse
                mask_u, mask_v = (1 << across) - 1, (1 << (log_height - level)) - 1
                mask_s, mask_t = (1 << across_shade) - 1, (1 << (bits_t - coarse)) - 1
                for x in range(side, side + run):
                    before = np.int64(used[x])
                    bits = FULL
                    if before != FULL and not solid <= x < solid_end:
                        bits = _samples(spans, x)
                    free = bits & ~before
                    if free != 0:
                        column, row = u >> 16, v >> 16
                        left, right = column & mask_u, (column + 1) & mask_u
                        upper = base + ((row & mask_v) << across)
                        lower = base + (((row + 1) & mask_v) << across)
                        a, b = np.uint64(u >> 12) & FIFTEEN, np.uint64(v >> 12) & FIFTEEN
                        p = np.uint64(pictures.pixels[np.uint64(upper + left)])
                        q = np.uint64(pictures.pixels[np.uint64(upper + right)])
                        m = np.uint64(pictures.pixels[np.uint64(lower + left)])
                        n = np.uint64(pictures.pixels[np.uint64(lower + right)])
                        weight_1, weight_2 = (SIXTEEN - a) * (SIXTEEN - b), a * (SIXTEEN - b)
                        weight_3, weight_4 = (SIXTEEN - a) * b, a * b
                        # Blue and red together, in the lower and the upper half of 32 bits.
                        both = (p & OUTER) * weight_1 + (q & OUTER) * weight_2
                        both += (m & OUTER) * weight_3 + (n & OUTER) * weight_4
                        green = (p & INNER) * weight_1 + (q & INNER) * weight_2
                        green += (m & INNER) * weight_3 + (n & INNER) * weight_4
                        if soft:
                            dark = np.int64((both >> EIGHT) & LOWEST)
                            shadow[y, x] = max(shadow[y, x], (dark * _count_samples(free)) >> 4)
                        else:
                            j = base_shade + (((t >> 16) & mask_t) << across_shade)
                            j += (s >> 16) & mask_s
                            light = gain * np.int64(shade.pixels[np.uint64(j)] & LOWEST)
                            blue = min((np.int64((both >> EIGHT) & LOWEST) * light) >> 15, 255)
                            middle = min((np.int64(green >> SIXTEEN) * light) >> 15, 255)
                            red = min((np.int64(both >> TWENTY_FOUR) * light) >> 15, 255)
                            if free == FULL:
                                out[x, 0], out[x, 1], out[x, 2] = blue, middle, red
                            else:
                                share = _count_samples(free)
                                out[x, 0] += (blue * share) >> 4
                                out[x, 1] += (middle * share) >> 4
                                out[x, 2] += (red * share) >> 4
                            used[x] = before | bits
                    u, v, s, t = u + du, v + dv, s + ds, t + dt


def sprite_of(
    canvas: NDArray[np.uint8], occupied: NDArray[np.uint16], shadow: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Return a rendering as a premultiplied sprite with a transparent border (`blend_sprite`)."""
    sprite = np.zeros((occupied.shape[0] + 2, occupied.shape[1] + 2, 4), np.uint8)
    sprite[1:-1, 1:-1, :3] = canvas
    coverage = np.bitwise_count(occupied) * np.uint16(255) // np.uint16(16) + shadow
    sprite[1:-1, 1:-1, 3] = np.minimum(coverage, 255)
    return sprite


@njit(cache=True)
def lay_behind(
    canvas: NDArray[np.uint8], occupied: NDArray[np.uint16], behind: NDArray[np.uint8]
) -> None:
    """Paint the image `behind` into the free samples of the first rows of a canvas."""
    for y in range(len(behind)):
        for x in range(occupied.shape[1]):
            left = 16 - _count_samples(np.int64(occupied[y, x]))
            for c in range(3):
                canvas[y, x, c] += (np.int64(behind[y, x, c]) * left) >> 4


Points = Sequence[tuple[float, float]]

BGR = tuple[float, float, float]

_FINE = 2  # supersampling per axis
_RUBBER = (34.0, 32.0, 32.0)
_PLASTIC = (52.0, 50.0, 50.0)
_GLASS = (62.0, 54.0, 48.0)
_SKY = (176.0, 164.0, 150.0)
_CHROME = (186.0, 184.0, 182.0)
_RED, _AMBER, _CLEAR = (38.0, 30.0, 168.0), (40.0, 130.0, 214.0), (214.0, 216.0, 214.0)


class CarSheet:
    """Drawing of one texture of a car in metres, on a background colour (BGR)."""

    def __init__(self, kind: int, colour: Sequence[float]) -> None:
        self._size = SIZES[kind]
        half = REACH if kind in (SIDE, TOP) else WIDE
        self._scale = np.array([self._size[0] / (2 * half), self._size[1] / TALL]) * _FINE
        self._left, self._top = -half, TALL
        if kind == TOP:
            self._scale[1], self._top = self._size[1] / (2 * WIDE) * _FINE, WIDE
        self._mirrored = kind == REAR
        width, height = self._size
        self._picture = np.empty((_FINE * height, _FINE * width, 3), np.uint8)
        self._picture[:] = np.round(colour)

    def fill(self, points: Points, colour: Sequence[float]) -> None:
        """Paint a polygon of points (horizontal, up) [metres]."""
        cv2.fillPoly(self._picture, [self._to_pixels(points)], list(colour), cv2.LINE_AA, 3)

    def box(self, x: tuple[float, float], y: tuple[float, float], colour: Sequence[float]) -> None:
        """Paint an upright rectangle."""
        self.fill([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])], colour)

    def disc(self, x: float, y: float, radius: float, colour: Sequence[float]) -> None:
        """Paint a filled circle."""
        angles = np.arange(40) * np.pi / 20
        self.fill([(x + radius * np.cos(a), y + radius * np.sin(a)) for a in angles], colour)

    def line(self, points: Points, colour: Sequence[float], width: float = 0.015) -> None:
        """Paint an open polyline."""
        thick = max(1, round(width * float(self._scale.mean())))
        shape = self._to_pixels(points, 0)
        cv2.polylines(self._picture, [shape], False, list(colour), thick, cv2.LINE_AA)

    def light(self, gains: Sequence[tuple[float, float]]) -> None:
        """Multiply the colours by a gain that depends on the height: pairs (height, gain)."""
        heights, values = np.array(gains).T
        rows = np.arange(len(self._picture)) + 0.5
        gain = np.interp(self._top - rows / self._scale[1], heights, values)
        lit = self._picture * gain[:, None, None]
        self._picture = np.clip(lit, 0, 255).astype(np.uint8)

    def finished(self) -> Array:
        """Return the picture at its final size."""
        return cv2.resize(self._picture, self._size, interpolation=cv2.INTER_AREA).astype(
            np.float64
        )

    def _to_pixels(self, points: Points, bits: int = 3) -> NDArray[np.int32]:
        places = np.array(points, np.float64)
        if self._mirrored:
            places = places * [-1, 1]
        x = (places[:, 0] - self._left) * self._scale[0]
        y = (self._top - places[:, 1]) * self._scale[1]
        return np.round(np.stack([x, y], axis=1) * (1 << bits)).astype(np.int32)


def paint_car_pictures(random: Generator, shape: CarShape, paint: BGR) -> Pictures:
    """Return all textures of a car in a paint; details and other colours are random."""
    style = _Style(random)
    sheets = [
        _side(shape, paint, style),
        _front(random, shape, paint, style),
        _rear(random, shape, paint, style),
        _top(shape, paint, style),
        _shadow(shape),
    ]
    return pack_pictures(sheets)


class _Style:
    """Random details that appear in several textures of a car."""

    def __init__(self, random: Generator) -> None:
        self.bumper: BGR | None = _PLASTIC if random.random() < 0.45 else None
        self.strip = bool(random.random() < 0.6)
        self.plate: BGR = (224.0, 226.0, 226.0) if random.random() < 0.6 else (70.0, 190.0, 220.0)
        self.doors = 2 if random.random() < 0.7 else 1
        self.spokes = int(random.integers(5, 8))
        self.sunroof = bool(random.random() < 0.3)


def _times(colour: BGR, gain: float) -> list[float]:
    return [min(gain * c, 255.0) for c in colour]


# gain by height: sheet metal reflects the street below its crease and the sky above it
_METAL = [(0.2, 0.62), (0.45, 0.8), (0.6, 0.98), (0.62, 1.06), (0.72, 1.0), (0.84, 1.12),
          (BELT, 1.28), (BELT + 0.02, 1.0), (2.0, 1.0)]  # fmt: skip


def _side(shape: CarShape, paint: BGR, style: _Style) -> Array:
    sheet = CarSheet(SIDE, paint)
    end, dark = shape.length / 2, _times(paint, 0.5)
    rear_axle = shape.axles[1]
    sheet.light(_METAL)
    sheet.box((-end, end), (0.0, 0.27), _PLASTIC)
    if style.bumper:
        sheet.box((end - 0.42, REACH), (0.0, 0.5), style.bumper)
        sheet.box((-REACH, 0.4 - end), (0.0, 0.5), style.bumper)
    if style.strip:
        sheet.box((-end, end), (0.48, 0.53), _PLASTIC)
    # Doors extend from the foot of the windscreen to the arch of the rear wheel.
    first, last = shape.screen[0] - 0.12, rear_axle + 0.42
    middle = first + (last - first) * (0.5 if style.doors == 2 else 0.62)
    for place in (first, middle, last) if style.doors == 2 else (first, middle):
        sheet.line([(place, 0.3), (place, BELT)], dark)
    sheet.line([(first, 0.3), (last if style.doors == 2 else middle, 0.3)], dark)
    for place in (middle, last) if style.doors == 2 else (middle,):
        sheet.box((place + 0.05, place + 0.22), (0.77, 0.81), dark)
    for axle in shape.axles:
        sheet.disc(axle, 0.33, 0.385, (20.0, 18.0, 18.0))
        sheet.disc(axle, TYRE, 0.335, _RUBBER)
        sheet.disc(axle, TYRE, 0.215, _CHROME)
        for angle in np.arange(style.spokes) * 2 * np.pi / style.spokes:
            tip = (axle + 0.17 * np.cos(angle), TYRE + 0.17 * np.sin(angle))
            sheet.disc(*tip, 0.045, (84.0, 84.0, 84.0))
        sheet.disc(axle, TYRE, 0.05, (96.0, 96.0, 96.0))
    # Lamps extend around the corners.
    sheet.box((end - 0.26, REACH), (0.56, shape.bonnet - 0.02), _AMBER)
    sheet.box((-REACH, 0.2 - end), (0.58, 0.82), _RED)
    # Windows.
    low, high = BELT + 0.03, shape.roof - 0.09
    share = (high - low) / (shape.roof - 0.05 - BELT)
    front_top = shape.screen[0] + share * (shape.screen[1] - shape.screen[0]) - 0.12
    rear_top = shape.rear_screen[0] + share * (shape.rear_screen[1] - shape.rear_screen[0]) + 0.1
    glass = [(shape.screen[0] - 0.14, low), (front_top, high), (rear_top, high),
             (shape.rear_screen[0] + 0.14, low)]  # fmt: skip
    _pane(sheet, glass, low, high)
    for seat in (first - 0.5, middle - 0.45):
        sheet.box((seat - 0.1, seat + 0.12), (low, 1.16), (36.0, 33.0, 32.0))
    for place in (middle, last + 0.02):
        lean = (rear_top - glass[3][0]) * 0.25
        sheet.fill([(place - 0.05, low), (place + 0.05, low), (place + 0.04 + lean, high),
                    (place - 0.04 + lean, high)], _times(paint, 0.62))  # fmt: skip
    mirror = shape.screen[0] - 0.22
    sheet.box((mirror, mirror + 0.17), (BELT + 0.01, BELT + 0.12), _times(paint, 0.8))
    return sheet.finished()


def _pane(sheet: CarSheet, outline: Points, low: float, high: float) -> None:
    """Paint a window: a dark interior, with the sky reflected in the upper part."""
    sheet.fill(outline, _GLASS)
    cut = low + 0.62 * (high - low)
    sheet.fill([(x, max(y, cut)) for x, y in outline], [0.62 * g + 0.38 * s for g, s in zip(
        _GLASS, _SKY, strict=True)])  # fmt: skip


def _end(kind: int, paint: BGR, style: _Style) -> CarSheet:
    """Return what front and rear textures share: sheet metal, dark underside, bumper."""
    sheet = CarSheet(kind, paint)
    sheet.light(_METAL)
    sheet.box((-WIDE, WIDE), (0.0, 0.23), (26.0, 24.0, 24.0))
    if style.bumper:
        sheet.box((-WIDE, WIDE), (0.23, 0.5), style.bumper)
    return sheet


def _front(random: Generator, shape: CarShape, paint: BGR, style: _Style) -> Array:
    sheet = _end(FRONT, paint, style)
    wide, edge = shape.width / 2, shape.bonnet
    sheet.box((-0.42, 0.42), (0.26, 0.34), (24.0, 22.0, 22.0))
    inner = random.uniform(0.4, 0.5)
    for side in (-1, 1):
        lamp = [(side * inner, 0.54), (side * WIDE, 0.54), (side * WIDE, edge - 0.015),
                (side * inner, edge - 0.03)]  # fmt: skip
        sheet.fill(lamp, _times(paint, 0.4))
        sheet.fill([(side * (abs(x) - 0.02 if abs(x) > 1 else abs(x) + 0.02), 0.56 if y < 0.6 else
                     y - 0.015) for x, y in lamp], _CLEAR)  # fmt: skip
        sheet.disc(side * (inner + 0.16), (0.54 + edge) / 2, 0.065, (150.0, 150.0, 148.0))
        sheet.box((min(side * (wide - 0.14), side * WIDE), max(side * (wide - 0.14), side * WIDE)),
                  (0.55, edge - 0.02), _AMBER)  # fmt: skip
    sheet.box((-inner + 0.03, inner - 0.03), (0.56, edge - 0.03), (30.0, 28.0, 28.0))
    for height in np.arange(0.585, edge - 0.04, 0.04):
        sheet.line([(-inner + 0.04, height), (inner - 0.04, height)], _times(_CHROME, 0.55), 0.012)
    sheet.disc(0.0, (0.56 + edge - 0.03) / 2, 0.05, _CHROME)
    _plate(sheet, random, 0.41, style.plate)
    _screen(sheet, shape, paint, 0.03)
    for x in (-0.36, 0.36):  # people in the front seats
        sheet.disc(x, 1.14, 0.10, (52.0, 50.0, 54.0))
        sheet.box((x - 0.2, x + 0.2), (BELT + 0.02, 1.06), (40.0, 38.0, 38.0))
    sheet.line([(-0.5, BELT + 0.03), (0.1, BELT + 0.09)], (22.0, 22.0, 22.0), 0.02)
    sheet.line([(0.05, BELT + 0.03), (0.6, BELT + 0.09)], (22.0, 22.0, 22.0), 0.02)
    return sheet.finished()


def _rear(random: Generator, shape: CarShape, paint: BGR, style: _Style) -> Array:
    sheet = _end(REAR, paint, style)
    wide = shape.width / 2
    inner, low = wide - random.uniform(0.3, 0.42), 0.57
    tall = random.uniform(0.8, 0.88)
    for side in (-1, 1):
        x = sorted((side * inner, side * WIDE))
        sheet.box((x[0], x[1]), (low - 0.015, tall + 0.015), _times(paint, 0.4))
        sheet.box((x[0], x[1]), (low, tall), _RED)
        sheet.box((x[0], x[1]), (tall - 0.09, tall), _AMBER)
        clear = sorted((side * inner, side * (inner + 0.12)))
        sheet.box((clear[0], clear[1]), (low, low + 0.09), _CLEAR)
    sheet.line([(-wide, 0.52), (wide, 0.52)], _times(paint, 0.5))
    sheet.line([(-wide + 0.1, 0.9), (wide - 0.1, 0.9)], _times(paint, 0.6))
    sheet.box((-0.32, 0.32), (0.6, 0.77), _times(paint, 0.72))
    _plate(sheet, random, 0.685, style.plate)
    sheet.disc(-0.45, 0.24, 0.04, _CHROME)
    _screen(sheet, shape, paint, 0.07)
    for seat in (-0.4, 0.4):  # head rests
        sheet.box((seat - 0.13, seat + 0.13), (BELT + 0.04, 1.13), (40.0, 37.0, 36.0))
    return sheet.finished()


def _screen(sheet: CarSheet, shape: CarShape, paint: BGR, edge: float) -> None:
    foot, eaves, _ = shape.cabin
    low, high = BELT + edge, eaves.height - 0.05
    sheet.fill([(-foot.half_width - 0.1, BELT), (foot.half_width + 0.1, BELT),
                (eaves.half_width + 0.1, eaves.height), (-eaves.half_width - 0.1, eaves.height)],
               _times(paint, 0.95))  # fmt: skip
    post = 0.075
    outline = [(-foot.half_width + post, low), (foot.half_width - post, low),
               (eaves.half_width - post + 0.01, high),
               (-eaves.half_width + post - 0.01, high)]  # fmt: skip
    _pane(sheet, outline, low, high)


def _plate(sheet: CarSheet, random: Generator, height: float, colour: BGR) -> None:
    sheet.box((-0.265, 0.265), (height - 0.06, height + 0.06), (30.0, 30.0, 30.0))
    sheet.box((-0.255, 0.255), (height - 0.052, height + 0.052), colour)
    left = -0.22
    while left < 0.2:
        wide = random.uniform(0.028, 0.045)
        if random.random() < 0.85:
            sheet.box((left, left + wide), (height - 0.035, height + 0.035), (40.0, 38.0, 38.0))
            inner = left + 0.3 * wide, left + 0.75 * wide
            sheet.box(inner, (height - 0.01, height + 0.02), colour)
        left += wide + 0.017


def _top(shape: CarShape, paint: BGR, style: _Style) -> Array:
    sheet = CarSheet(TOP, _times(paint, 1.06))
    dark = _times(paint, 0.55)
    foot = shape.cabin[0]
    for side in (-1, 1):
        sheet.line([(shape.length / 2 - 0.1, side * (shape.width / 2 - 0.16)),
                    (shape.screen[0], side * (shape.width / 2 - 0.1))], dark)  # fmt: skip
        sheet.line([(shape.length / 2 - 0.2, side * 0.3), (shape.screen[0] + 0.1, side * 0.42)],
                   _times(paint, 0.9), 0.04)  # fmt: skip
    sheet.box((shape.screen[0] - 0.02, shape.screen[0] + 0.09), (-0.66, 0.66), _PLASTIC)
    sheet.line([(shape.rear_screen[0] - 0.04, -foot.half_width),
                (shape.rear_screen[0] - 0.04, foot.half_width)], dark)  # fmt: skip
    if style.sunroof:
        front = shape.screen[1] - 0.35
        sheet.box((front - 0.5, front), (-0.38, 0.38), _GLASS)
        sheet.box((front - 0.5, front - 0.3), (-0.38, 0.38), _times(_SKY, 0.7))
    return sheet.finished()


def _shadow(shape: CarShape) -> Array:
    """Return the shadow below the car: a superellipse of power 4 that fades to its outline."""
    width, height = SIZES[SHADOW]
    y, x = np.meshgrid(
        (np.arange(height) + 0.5) / height * 2 - 1, (np.arange(width) + 0.5) / width * 2 - 1,
        indexing="ij",
    )  # fmt: skip
    far = np.sqrt(np.sqrt((x * x) * (x * x) + (y * y) * (y * y)))
    dark = np.clip((1.0 - far) / 0.5, 0, 1)
    return np.repeat((dark * dark * (3 - 2 * dark) * 190.0)[..., None], 3, axis=2)


_BLANK = blank_pictures(5)
_UNSHADED = blank_pictures()
_SPARE = 16  # pixels beyond the canvas, needed for motion blur


class Car:
    """Car with a shape and a paint (BGR); `seed` determines its random details."""

    def __init__(self, shape: CarShape, paint: BGR, seed: int) -> None:
        self.shape = shape
        self.paint = paint
        self._seed = seed

    @cached_property
    def facets(self) -> Facets:
        """All facets, including the shadow."""
        return self.shape.facets

    @cached_property
    def body(self) -> Facets:
        """All facets except the shadow."""
        corners, counts, normals, kinds, places, soft = self.facets
        hard = ~soft
        return Facets(
            corners[hard], counts[hard], normals[hard], kinds[hard], places[hard], soft[hard]
        )

    @cached_property
    def pictures(self) -> Pictures:
        """Textures of the facets."""
        return paint_car_pictures(np.random.default_rng(self._seed), self.shape, self.paint)


@dataclass(frozen=True)
class CarAt:
    """Car at a position on the ground; implements `Drawable`."""

    car: Car
    x: float  # centre on the ground, to the right [metres]
    z: float  # centre on the ground, ahead [metres]
    heading: float  # [radians]
    light: Light = OVERCAST
    # image displacement during the exposure, right and down [pixels]
    motion: tuple[float, float] = (0.0, 0.0)
    # fractions of `motion` at which the car is drawn; their number is a power of two
    moments: tuple[float, ...] = (0.0,)

    reach = 3.0  # see `Drawable.reach`

    def box(self, view: PerspectiveView) -> Array:
        """Return the extents [x, y, width, height] of the whole car in the image [pixels]."""
        left, right, top, bottom, _ = self._extents(self.car.body, view)
        return np.array([left, top, right - left, bottom - top])

    def window(self, view: PerspectiveView) -> Window | None:
        low_x, high_x, low_y, high_y, nearest = self._extents(self.car.facets, view)
        if nearest < NEAREST_DRAWN / 2:
            return None
        x, y = (math.ceil(abs(shift) / 2) + 1 for shift in self.motion)
        return (
            math.floor(low_x) - x,
            math.floor(low_y) - y,
            math.ceil(high_x) + x,
            math.ceil(high_y) + y,
        )

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Draw the car with its shadow; see `Drawable.draw`."""
        rendered = self._render(self.car.facets, view, canvas.shape[1::-1], self.car.pictures)
        if rendered is None:
            return
        sprite, left, top = rendered
        right, down = (np.multiply(self.moments, shift) for shift in self.motion)
        lefts = np.round((left + right) * 64).astype(np.int64)
        tops = np.round((top + down) * 64).astype(np.int64)
        blend_sprite(canvas, sprite, lefts, tops, 65536)

    def coverage(self, view: PerspectiveView, size: tuple[int, int]) -> Coverage:
        """Return the silhouette in an image of `size` (width, height), without the shadow."""
        rendered = self._render(self.car.body, view, size, _BLANK)
        if rendered is None:
            return 0, 0, np.zeros((0, 0), np.uint8)
        sprite, left, top = rendered
        return left, top, sprite[1:-1, 1:-1, 3].copy()

    def _extents(
        self, facets: Facets, view: PerspectiveView
    ) -> tuple[float, float, float, float, float]:
        pose = self._pose(facets, view)
        left, right, top, bottom, nearest = facet_extents(
            facets, pose, Lens(view.focal, *view.centre)
        )
        return left, right, top, bottom, nearest

    def _pose(self, facets: Facets, view: PerspectiveView) -> FacetPose:
        return facet_pose(view, facets, (self.x, 0.0, self.z), self.heading, self.light)

    def _render(
        self, facets: Facets, view: PerspectiveView, size: tuple[int, ...], pictures: Pictures
    ) -> tuple[NDArray[np.uint8], int, int] | None:
        """Render the part of the car in or near the image; return sprite, left and top [pixels]."""
        window = self.window(view)
        if window is None:
            return None
        left, top = max(window[0], -_SPARE), max(window[1], -_SPARE)
        width = min(window[2], size[0] + _SPARE) - left
        height = min(window[3], size[1] + _SPARE) - top
        if width <= 0 or height <= 0:
            return None
        colour = np.zeros((height, width, 3), np.uint8)
        occupied = np.zeros((height, width), np.uint16)
        shadow = np.zeros((height, width), np.uint8)
        lens = Lens(view.focal, view.centre[0] - left, view.centre[1] - top)
        order = np.arange(len(facets.counts))
        pose = self._pose(facets, view)
        lay_facets(colour, occupied, shadow, facets, pictures, _UNSHADED, lens, pose, order)
        return sprite_of(colour, occupied, shadow), left, top


PAINTS: tuple[BGR, ...] = (
    (38, 34, 150),  # red
    (46, 36, 92),  # dark red
    (148, 92, 42),  # blue
    (88, 54, 36),  # dark blue
    (66, 96, 44),  # green
    (60, 150, 190),  # yellow
    (196, 202, 204),  # white
    (164, 166, 166),  # silver
    (94, 94, 94),  # grey
    (44, 42, 42),  # black
    (128, 156, 172),  # beige
)

# paints of targets: all except the colour of the road
TARGETS = tuple(paint for paint in PAINTS if paint != (94, 94, 94))
CLEAR = 60.0  # two paints differ clearly if one channel differs by this much [grey levels]


def sample_paint(random: Generator, choice: tuple[BGR, ...] = PAINTS) -> BGR:
    """Sample one of the paints and vary it slightly."""
    colour = np.array(choice[random.integers(len(choice))])
    blue, green, red = (colour * random.uniform(0.92, 1.08) + random.uniform(-4, 4, 3)).tolist()
    return blue, green, red


def contrasting_paints(target: BGR) -> tuple[BGR, ...]:
    """Return the paints that differ clearly from the target's paint."""
    return tuple(p for p in PAINTS if np.abs(np.subtract(p, target)).max() >= CLEAR)


def sample_car(random: Generator, choice: tuple[BGR, ...] = PAINTS) -> Car:
    """Sample a car of random shape, in one of the paints `choice`."""
    return Car(sample_car_shape(random), sample_paint(random, choice), int(random.integers(2**32)))
