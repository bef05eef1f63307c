"""Rasteriser of textured facets in perspective, from front to back, in compiled kernels.

A pixel has 4 x 4 samples. The first facet that covers a sample occupies it. Therefore edges are
smooth, adjacent facets leave no gap, and hidden facets are not painted. Corners are rounded to 1/64
pixel; all pixel arithmetic uses integers. `lay_facets` is one long kernel, because its inner loop
uses some thirty numbers that a called kernel would need as arguments.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import (
    MAX_CORNERS,
    FacetPose,
    Facets,
    Lens,
    Pictures,
)

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
