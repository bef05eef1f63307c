"""Triangle mesh of body parts, posed by bones, projected by a camera and painted.

Projected vertices are rounded to a fraction of a pixel; all pixel arithmetic uses integers.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array

FINE = 2  # samples per pixel and axis
NO_TRIANGLE = -1  # triangle index of a sample that no triangle covers
UNIT = 32  # number of fixed-point steps per sample and per texel

_BITS = 20  # number of bits for the index of a triangle in a key
_NEARNESS = 1 << 21  # nearness at a distance of one metre


@njit(cache=True, error_model="numpy")
def place_vertices(
    positions: Array,
    normals: Array,
    bones: NDArray[np.int64],
    axes: Array,
    origins: Array,
    lamp: Array,
    camera: Array,
) -> NDArray[np.int64]:
    """Return column and row [1/UNIT sample], nearness and light [1/256] of vertices, shape (v, 4).

    `positions` and `normals`, shape (v, 3), are relative to the bone of each vertex [metres]. The
    columns of `axes`, shape (b, 3, 3), are the axes of each bone in the world: x to the right, y
    up, z away from the camera. `origins` are the positions of the bones [metres]. `lamp` is the
    direction to the light and the ambient light. The light is diffuse: surfaces perpendicular to
    its direction receive half of it. `camera` is focal length, column and row of the optical axis
    [pixels], and height [metres].
    """
    placed = np.empty((len(positions), 4), np.int64)
    for i in range(len(positions)):
        b = bones[i]
        x, y, z, towards = origins[b, 0], origins[b, 1], origins[b, 2], 0.0
        for j in range(3):
            x += axes[b, 0, j] * positions[i, j]
            y += axes[b, 1, j] * positions[i, j]
            z += axes[b, 2, j] * positions[i, j]
            for k in range(3):
                towards += axes[b, k, j] * normals[i, j] * lamp[k]
        scale = camera[0] / z
        placed[i, 0] = round((camera[1] + x * scale) * FINE * UNIT)
        placed[i, 1] = round((camera[2] + (camera[3] - y) * scale) * FINE * UNIT)
        placed[i, 2] = round(_NEARNESS / z)
        placed[i, 3] = round(256 * (lamp[3] + (1 - lamp[3]) * (0.5 + 0.5 * towards)))
    return placed


@njit(cache=True, error_model="numpy")
def visible_triangles(
    placed: NDArray[np.int64],
    triangles: NDArray[np.int64],
    left: int,
    top: int,
    height: int,
    width: int,
) -> NDArray[np.int64]:
    """Return the nearest camera-facing triangle of each sample of a window, or `NO_TRIANGLE`.

    `placed` is the result of `place_vertices`. `triangles`, shape (t, 3), are clockwise in the
    image if they face the camera. The window [pixels] may exceed the image. The result has the
    shape (height * FINE, width * FINE).
    """
    # The upper bits of a key are the nearness, so the maximum key is that of the nearest triangle.
    keys = np.full((height * FINE, width * FINE), NO_TRIANGLE, np.int64)
    half = UNIT // 2
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a_x, a_y = placed[a, 0] - left * FINE * UNIT, placed[a, 1] - top * FINE * UNIT
        b_x, b_y = placed[b, 0] - left * FINE * UNIT, placed[b, 1] - top * FINE * UNIT
        c_x, c_y = placed[c, 0] - left * FINE * UNIT, placed[c, 1] - top * FINE * UNIT
        area = (b_x - a_x) * (c_y - a_y) - (b_y - a_y) * (c_x - a_x)
        if area <= 0:
            continue
        first_x = max((min(a_x, b_x, c_x) + half - 1) // UNIT, 0)
        last_x = min((max(a_x, b_x, c_x) - half) // UNIT, keys.shape[1] - 1)
        first_y = max((min(a_y, b_y, c_y) + half - 1) // UNIT, 0)
        last_y = min((max(a_y, b_y, c_y) - half) // UNIT, keys.shape[0] - 1)
        if first_x > last_x or first_y > last_y:
            continue
        near_b, near_c = placed[b, 2] - placed[a, 2], placed[c, 2] - placed[a, 2]
        slope_x = ((near_b * (c_y - a_y) - near_c * (b_y - a_y)) << 8) // area
        slope_y = ((near_c * (b_x - a_x) - near_b * (c_x - a_x)) << 8) // area
        x = first_x * UNIT + half
        for row in range(first_y, last_y + 1):
            y = row * UNIT + half
            wa = (c_x - b_x) * (y - b_y) - (c_y - b_y) * (x - b_x)
            wb = (a_x - c_x) * (y - c_y) - (a_y - c_y) * (x - c_x)
            near = (placed[a, 2] << 8) + slope_x * (x - a_x) + slope_y * (y - a_y)
            across_a, across_b = (b_y - c_y) * UNIT, (c_y - a_y) * UNIT
            line = keys[row, first_x : last_x + 1]
            for column in range(len(line)):
                outside = (wa | wb | (area - wa - wb)) >> 63
                key = (near >> 8) << _BITS | t | outside
                line[column] = max(line[column], key)
                wa += across_a
                wb += across_b
                near += slope_x * UNIT
    flat = keys.ravel()
    for sample in range(len(flat)):
        flat[sample] = flat[sample] & ((1 << _BITS) - 1) | flat[sample] >> 63
    return keys


@njit(cache=True, error_model="numpy", inline="always")
def _interpolated(
    placed: NDArray[np.int64], places: NDArray[np.int64], i: int, j: int, k: int, x: int, y: int
) -> tuple[int, int, int]:
    """Return the atlas position and the light of a point in a triangle."""
    a_x, a_y = placed[i, 0], placed[i, 1]
    b_x, b_y = placed[j, 0], placed[j, 1]
    c_x, c_y = placed[k, 0], placed[k, 1]
    area = (b_x - a_x) * (c_y - a_y) - (b_y - a_y) * (c_x - a_x)
    wa = (c_x - b_x) * (y - b_y) - (c_y - b_y) * (x - b_x)
    wb = (a_x - c_x) * (y - c_y) - (a_y - c_y) * (x - c_x)
    wc = area - wa - wb
    share = (1 << 40) // area
    u = ((wa * places[i, 0] + wb * places[j, 0] + wc * places[k, 0]) * share) >> 40
    v = ((wa * places[i, 1] + wb * places[j, 1] + wc * places[k, 1]) * share) >> 40
    light = ((wa * placed[i, 3] + wb * placed[j, 3] + wc * placed[k, 3]) * share) >> 40
    return u, v, light


@njit(cache=True, error_model="numpy", inline="always")
def _texel(atlas: NDArray[np.uint8], u: int, v: int, channel: int) -> int:
    """Return the bilinear interpolation of four texels, times UNIT squared."""
    left, upper = (u // UNIT) & (atlas.shape[1] - 1), v // UNIT
    right, lower = (left + 1) & (atlas.shape[1] - 1), min(upper + 1, len(atlas) - 1)
    a, b = u & (UNIT - 1), v & (UNIT - 1)
    above = (UNIT - a) * atlas[upper, left, channel] + a * atlas[upper, right, channel]
    below = (UNIT - a) * atlas[lower, left, channel] + a * atlas[lower, right, channel]
    mixed: int = (UNIT - b) * above + b * below
    return mixed


@njit(cache=True, error_model="numpy")
def paint_owners(
    owners: NDArray[np.int64],
    placed: NDArray[np.int64],
    triangles: NDArray[np.int64],
    parts: NDArray[np.int64],
    places: NDArray[np.int64],
    atlas: NDArray[np.uint8],
    left: int,
    top: int,
    gain: int,
) -> NDArray[np.uint8]:
    """Paint a mesh in the format of `blend_sprite`, with one colour per body part and pixel.

    `owners` is the result of `visible_triangles`; (left, top) is the corner of the window [pixels].
    `parts`, shape (t,), is the body part of each triangle. `places`, shape (v, 2), is column and
    row of each vertex in the atlas [1/UNIT texel]. `atlas`, shape (rows, 2**k, 3), contains the
    textures one below the other; they are horizontally periodic. `gain` is the light, times 256.
    """
    height, width = owners.shape[0] // FINE, owners.shape[1] // FINE
    picture = np.zeros((height + 2, width + 2, 4), np.uint8)
    samples, half = FINE * FINE, FINE * FINE // 2
    for row in range(height):
        for column in range(width):
            part = NO_TRIANGLE
            blue, green, red, covered = 0, 0, 0, 0
            b, g, r = 0, 0, 0
            for sample in range(samples):
                sample_y = row * FINE + sample // FINE
                sample_x = column * FINE + sample % FINE
                t = owners[sample_y, sample_x]
                if t == NO_TRIANGLE:
                    continue
                if parts[t] != part:
                    part = parts[t]
                    y = (sample_y + top * FINE) * UNIT + UNIT // 2
                    x = (sample_x + left * FINE) * UNIT + UNIT // 2
                    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                    u, v, light = _interpolated(placed, places, i, j, k, x, y)
                    light *= gain
                    b = min((_texel(atlas, u, v, 0) * light) >> 26, 255)
                    g = min((_texel(atlas, u, v, 1) * light) >> 26, 255)
                    r = min((_texel(atlas, u, v, 2) * light) >> 26, 255)
                blue, green, red, covered = blue + b, green + g, red + r, covered + 255
            if covered > 0:
                picture[row + 1, column + 1, 0] = (blue + half) // samples
                picture[row + 1, column + 1, 1] = (green + half) // samples
                picture[row + 1, column + 1, 2] = (red + half) // samples
                picture[row + 1, column + 1, 3] = (covered + half) // samples
    return picture


# number of texture columns around a body part; column 0 is the front, AROUND / 4 the left
AROUND = 256


@dataclass(frozen=True)
class Solid:
    """Body part in its own coordinates: x to the left, y up, z forward."""

    # (rows, AROUND + 1, 3), positions of the texels, from one end to the other [metres]; the last
    # column equals the first. A mesh uses every `spacing`-th row, including the first and the last.
    surface: Array
    texture: Array  # (rows, AROUND, 3), BGR in [0, 255]
    # texels between adjacent vertices of the mesh, vertical and horizontal
    spacing: tuple[int, int]

    @property
    def vertices(self) -> Array:
        """Vertices of the mesh as a grid, shape (r, a, 3)."""
        down, around = self.spacing
        return self.surface[::down, ::around]

    @property
    def normals(self) -> Array:
        """Outward directions at the vertices, shape (r, a, 3)."""
        grid = self.vertices
        along = np.gradient(grid, axis=0)
        ring = np.concatenate([grid[:, -2:-1], grid, grid[:, 1:2]], axis=1)
        across = ring[:, 2:] - ring[:, :-2]
        normal = np.cross(along, across)
        return np.asarray(normal / (np.sqrt((normal * normal).sum(axis=2, keepdims=True)) + 1e-12))


def turns(rows: int) -> tuple[Array, Array]:
    """Return the relative row (0 to 1) and the angle from the front [radians] of each texel."""
    down = np.linspace(0, 1, rows)[:, None] * np.ones(AROUND + 1)
    around = np.ones((rows, 1)) * np.linspace(0, 2 * np.pi, AROUND + 1)
    return down, around


def loft(rows: int, profile: ArrayLike, power: float = 2.0) -> Array:
    """Return a surface through stacked cross-sections, shape (rows, AROUND + 1, 3).

    The rows of `profile` are evenly spaced along the texture. The columns are height, half width,
    extent to the front, extent to the back, height of the front above the centre, and forward shift
    [metres]. A `power` of 2 makes ellipses; larger values make rounded rectangles.
    """
    knots = np.asarray(profile, np.float64)
    place = np.linspace(0, len(knots) - 1, rows)
    columns = [_smoothed(np.interp(place, np.arange(len(knots)), knot), rows) for knot in knots.T]
    height, width, front, back, tilt, shift = (column[:, None] for column in columns)
    _, angle = turns(rows)
    left, forward = np.sin(angle), np.cos(angle)
    norm = (np.abs(left) ** power + np.abs(forward) ** power) ** (1 / power)
    left, forward = left / norm, forward / norm
    reach = np.where(forward > 0, front, back)
    return np.stack([width * left, height + tilt * forward, shift + reach * forward], axis=2)


def _smoothed(values: Array, rows: int) -> Array:
    """Smooth a profile between its two ends."""
    reach = rows // 24
    weights = np.hanning(2 * reach + 3)[1:-1]
    padded = np.pad(values, reach, mode="reflect", reflect_type="odd")
    return np.convolve(padded, weights / weights.sum(), "valid")
