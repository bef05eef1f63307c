"""Solids and objects made of them, ray-traced for a distant camera with parallel rays.

Lengths are in image pixels: x to the right, y up, z towards the camera. A solid is a row of
numbers. An object is a list of solids, which can merge smoothly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array

HALF_SPACE, LIMB, BOX, BOWL = range(4)  # kind of a solid: the first number of its row


def half_space(normal: Sequence[float], reach: float) -> Array:
    """Return the half-space behind a plane at the distance `reach` from the origin."""
    return _solid(HALF_SPACE, 0.0, *normal, reach)


def limb(start: ArrayLike, end: ArrayLike, radii: tuple[float, float], blend: float = 0.0) -> Array:
    """Return the hull of two balls; it merges with other solids over the distance `blend`."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    return _solid(LIMB, blend, *a, *b, *radii)


def chain(points: ArrayLike, radii: ArrayLike, blend: float) -> list[Array]:
    """Return limbs between consecutive points; `radii` are the radii at these points."""
    joints, wide = np.asarray(points, np.float64), np.asarray(radii, np.float64).tolist()
    return [
        limb(joints[k], joints[k + 1], (wide[k], wide[k + 1]), blend)
        for k in range(len(joints) - 1)
    ]


def mirror_limbs(limbs: Sequence[Array], side: float) -> list[Array]:
    """Mirror limbs in place from one hand to the other if `side` is -1."""
    for solid in limbs:
        solid[[3, 6]] *= side
    return list(limbs)


def box(
    middle: ArrayLike,
    half: ArrayLike,
    rounding: float,
    turn: float = 0.0,
    lean: float = 0.0,
    folds: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Return a box with rounded edges; centre, half size and edge radius are in pixels.

    The box is rotated about the vertical axis, then leant backwards [radians]. `folds` are the
    depth of vertical folds [pixels] and their angular frequency [radians/pixel].
    """
    centre, size = np.asarray(middle, np.float64), np.asarray(half, np.float64) - rounding
    turned = np.cos(turn), np.sin(turn), np.cos(lean), np.sin(lean)
    return _solid(BOX, 0.0, *centre, *size, rounding, *turned, *folds)


def bowl(
    foot: ArrayLike, height: float, radii: tuple[float, float], wall: float, closed: bool = False
) -> Array:
    """Return a round vessel, which has a lid if it is `closed`.

    `radii` are the lower and the upper radius of the middle of the wall.
    """
    base = np.asarray(foot, np.float64)
    return _solid(BOWL, 0.0, *base, height, *radii, wall / 2, float(closed))


def _solid(kind: int, blend: float, *numbers: float) -> Array:
    row = np.zeros(16)
    row[[0, 2]] = kind, blend
    row[3 : 3 + len(numbers)] = numbers
    return row


def pack_objects(things: Sequence[Sequence[Array]]) -> tuple[Array, Array]:
    """Return the solids of all objects, shape (s, 16), and their bounding balls, shape (t, 6).

    A row of the balls contains centre and radius [pixels], and the range of the object's solids:
    first index (inclusive) and last index (exclusive).
    """
    counts = np.array([len(thing) for thing in things])
    ends = np.cumsum(counts)
    balls = np.column_stack([np.stack([_ball(thing) for thing in things]), ends - counts, ends])
    return np.array([solid for thing in things for solid in thing]), balls


def _ball(thing: Sequence[Array]) -> Array:
    """Return centre and radius of a bounding ball of an object, shape (4,) [pixels]."""
    lows, highs = zip(*(_bounds(solid) for solid in thing), strict=True)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    return np.append((low + high) / 2, np.sqrt(np.sum((high - low) ** 2)) / 2)


def _bounds(solid: Array) -> tuple[Array, Array]:
    """Return two opposite corners of an axis-parallel box that contains a solid [pixels]."""
    middle = solid[3:6]
    if solid[0] == HALF_SPACE:
        return np.full(3, -1e4), np.full(3, 1e4)
    if solid[0] == LIMB:
        reach = max(solid[9:11]) + solid[2]
        return np.minimum(middle, solid[6:9]) - reach, np.maximum(middle, solid[6:9]) + reach
    if solid[0] == BOX:
        reach = np.sqrt(np.sum(solid[6:9] ** 2)) + solid[9] + 2 * solid[14]
        return middle - reach, middle + reach
    reach = max(solid[7:9]) + solid[9]
    low, high = middle - reach, middle + reach
    low[1], high[1] = middle[1] - solid[9], middle[1] + solid[6] + solid[9]
    return low, high


NOTHING = -1  # object index of a sample that no object covers

_START, _END = 150.0, 420.0  # start and end of a ray, relative to the image plane [pixels]


@dataclass(frozen=True)
class ParallelView:
    """Viewing direction and direction of light."""

    pitch: float  # downward angle of the camera [radians]
    light: tuple[float, float, float]  # direction to the lamp, of length 1

    def row(self, y: ArrayLike, z: ArrayLike) -> Array:
        """Return the row of a point relative to the origin [pixels]."""
        height, depth = np.asarray(y, np.float64), np.asarray(z, np.float64)
        return np.asarray(depth * np.sin(self.pitch) - height * np.cos(self.pitch))


@njit(cache=True, error_model="numpy")
def _to_segment(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> float:
    along_x, along_y = x1 - x0, y1 - y0
    share = ((x - x0) * along_x + (y - y0) * along_y) / (along_x * along_x + along_y * along_y)
    share = min(max(share, 0.0), 1.0)
    x, y = x - x0 - share * along_x, y - y0 - share * along_y
    return float(np.sqrt(x * x + y * y))


@njit(cache=True, error_model="numpy")
def _distance_to(s: Array, i: int, x: float, y: float, z: float) -> float:
    """Return the signed distance of a point to a solid [pixels]; it is negative inside."""
    if s[i, 0] == HALF_SPACE:
        return float(s[i, 3] * x + s[i, 4] * y + s[i, 5] * z - s[i, 6])
    x, y, z = x - s[i, 3], y - s[i, 4], z - s[i, 5]
    if s[i, 0] == LIMB:
        u, v, w = s[i, 6] - s[i, 3], s[i, 7] - s[i, 4], s[i, 8] - s[i, 5]
        share = min(max((x * u + y * v + z * w) / (u * u + v * v + w * w), 0.0), 1.0)
        x, y, z = x - share * u, y - share * v, z - share * w
        return float(np.sqrt(x * x + y * y + z * z) - s[i, 9] - share * (s[i, 10] - s[i, 9]))
    if s[i, 0] == BOX:
        x, z = s[i, 10] * x - s[i, 11] * z, s[i, 11] * x + s[i, 10] * z
        y, z = s[i, 12] * y - s[i, 13] * z, s[i, 13] * y + s[i, 12] * z
        if s[i, 14] > 0:
            z += s[i, 14] * (np.sin(s[i, 15] * x) + 0.4 * np.sin(2.3 * s[i, 15] * x + 0.05 * y))
        u, v, w = abs(x) - s[i, 6], abs(y) - s[i, 7], abs(z) - s[i, 8]
        beyond = np.sqrt(max(u, 0.0) ** 2 + max(v, 0.0) ** 2 + max(w, 0.0) ** 2)
        return float(beyond + min(max(u, v, w), 0.0) - s[i, 9])
    radius = np.sqrt(x * x + z * z)
    nearest = min(
        _to_segment(radius, y, s[i, 7], 0.0, s[i, 8], s[i, 6]),
        _to_segment(radius, y, 0.0, 0.0, s[i, 7], 0.0),
    )
    if s[i, 10] > 0:
        nearest = min(nearest, _to_segment(radius, y, 0.0, s[i, 6], s[i, 8], s[i, 6]))
    return float(nearest - s[i, 9])


@njit(cache=True, error_model="numpy")
def _distance(solids: Array, balls: Array, x: float, y: float, z: float) -> tuple[float, int]:
    """Return distance [pixels] and index of the nearest object to a point; see `pack_objects`."""
    nearest, owner = 1e9, NOTHING
    for thing in range(len(balls)):
        u, v, w = x - balls[thing, 0], y - balls[thing, 1], z - balls[thing, 2]
        reach = nearest + balls[thing, 3]
        if reach <= 0 or u * u + v * v + w * w > reach * reach:
            continue  # no part of this object is nearer than the nearest object
        object_distance = 1e9
        for i in range(int(balls[thing, 4]), int(balls[thing, 5])):
            solid_distance = _distance_to(solids, i, x, y, z)
            blend = solids[i, 2]
            near = blend - abs(object_distance - solid_distance)
            object_distance = min(object_distance, solid_distance)
            if near > 0:
                object_distance -= near * near / (4 * blend)
        if object_distance < nearest:
            nearest, owner = object_distance, thing
    return nearest, owner


@njit(cache=True, error_model="numpy")
def _max_slope(solid: Array) -> float:
    """Return an upper bound of the slope of `_distance_to` for a solid."""
    slope = 0.0
    if solid[0] == LIMB:
        length = np.sqrt(np.sum((solid[6:9] - solid[3:6]) ** 2))
        slope = abs(solid[10] - solid[9]) / length if length > 0 else np.inf
    elif solid[0] == BOX:
        slope = abs(solid[14]) * (1.92 * abs(solid[15]) + 0.02)
    return 1.001 + slope


@njit(cache=True, error_model="numpy")
def _facing_planes(solids: Array, balls: Array, view_y: float, view_z: float) -> NDArray[np.int64]:
    """Return the indices of half-space objects to which every ray gets nearer."""
    numbers, count = np.empty(len(balls), np.int64), 0
    for thing in range(len(balls)):
        i = int(balls[thing, 4])
        alone = balls[thing, 5] == i + 1 and solids[i, 0] == HALF_SPACE
        if alone and solids[i, 4] * view_y + solids[i, 5] * view_z >= 0:
            numbers[count] = i
            count += 1
    return numbers[:count]


@njit(cache=True, error_model="numpy")
def _select_near_objects(
    balls: Array, things: NDArray[np.int64], n: int,
    x: float, below: float, view_y: float, view_z: float, limit: float,
) -> int:  # fmt: skip
    """Move the objects that a ray may approach within `limit` to the front; count them."""
    count = 0
    for k in range(n):
        thing = things[k]
        u, v = x - balls[thing, 0], below - balls[thing, 2] * view_y + balls[thing, 1] * view_z
        reach = limit + 1e-6 + balls[thing, 3]
        if reach > 0 and u * u + v * v <= reach * reach:
            things[count] = thing
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def _distance_along(
    solids: Array, balls: Array, things: NDArray[np.int64], n: int,
    x: float, y: float, z: float, travelled: float, hint: int,
    bounds: Array, steepest: Array, solid_bounds: Array, solid_steepest: Array,
) -> tuple[float, int]:  # fmt: skip
    """Return `_distance` at a point of a ray, using the bounds from its earlier points.

    The first `n` of `things` are candidates for the nearest object. `travelled` is the length of
    the ray up to this point [pixels]. `hint` is the object that was nearest at the previous point.
    It is measured first, because it excludes most other objects.
    """
    nearest, owner = 1e9, NOTHING
    for turn in range(-1, n):
        thing = hint if turn < 0 else things[turn]
        if thing == NOTHING or (turn >= 0 and thing == hint):
            continue
        if bounds[thing] - steepest[thing] * travelled > nearest:
            continue
        u, v, w = x - balls[thing, 0], y - balls[thing, 1], z - balls[thing, 2]
        reach = nearest + balls[thing, 3]
        if reach <= 0 or u * u + v * v + w * w > reach * reach:
            continue  # no part of this object is nearer than the nearest object
        object_distance = 1e9
        for i in range(int(balls[thing, 4]), int(balls[thing, 5])):
            blend = solids[i, 2]
            if solid_bounds[i] - solid_steepest[i] * travelled > object_distance + blend:
                continue
            solid_distance = _distance_to(solids, i, x, y, z)
            solid_bounds[i] = solid_distance + solid_steepest[i] * travelled - 1e-6
            near = blend - abs(object_distance - solid_distance)
            object_distance = min(object_distance, solid_distance)
            if near > 0:
                object_distance -= near * near / (4 * blend)
        bounds[thing] = object_distance + steepest[thing] * travelled - 1e-6
        if object_distance < nearest or (object_distance == nearest and thing < owner):
            nearest, owner = object_distance, thing
    return nearest, owner


@njit(cache=True, error_model="numpy")
def _surface_normal(
    solids: Array, balls: Array, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return the outward normal of the surface at a point."""
    near = 0.05
    u = _distance(solids, balls, x + near, y, z)[0] - _distance(solids, balls, x - near, y, z)[0]
    v = _distance(solids, balls, x, y + near, z)[0] - _distance(solids, balls, x, y - near, z)[0]
    w = _distance(solids, balls, x, y, z + near)[0] - _distance(solids, balls, x, y, z - near)[0]
    length = np.sqrt(u * u + v * v + w * w) + 1e-12
    return u / length, v / length, w / length


@njit(cache=True, error_model="numpy")
def _surface_light(
    solids: Array, balls: Array, x: float, y: float, z: float, light: Array, view_z: float
) -> tuple[float, float]:
    """Return light and lamp reflection at a surface point; `view_z` is as in `_cast`."""
    u, v, w = _surface_normal(solids, balls, x, y, z)
    x, y, z = x + 0.15 * u, y + 0.15 * v, z + 0.15 * w
    sky, reach, weight = 1.0, 0.9, 0.36
    for _ in range(4):  # nearby surfaces occlude ambient light
        gap = _distance(solids, balls, x + reach * u, y + reach * v, z + reach * w)[0]
        sky -= weight * max(reach - gap, 0.0) / reach
        reach, weight = 1.9 * reach, 0.72 * weight
    towards = max(u * light[0] + v * light[1] + w * light[2], 0.0)
    sun, travelled = 1.0, 0.6
    while towards > 0 and travelled < 70 and sun > 0.01:
        gap = _distance(
            solids,
            balls,
            x + travelled * light[0],
            y + travelled * light[1],
            z + travelled * light[2],
        )[0]
        # The lamp is extended, so its shadow is soft.
        sun = min(sun, max(0.5 + 4.5 * gap / travelled, 0.0))
        travelled += min(max(gap, 0.35), 6.0)
    # Half-way direction between lamp and camera. It has no y, because the lamp is a tall window.
    half_x, half_z = light[0], light[2] + view_z
    shine = (u * half_x + w * half_z) / np.sqrt(half_x * half_x + half_z * half_z)
    ambient = (0.30 + 0.12 * v + 0.04 * w) * max(sky, 0.15)
    return ambient + 0.88 * towards * sun, max(shine, 0.0) ** 40 * sun


@njit(cache=True, error_model="numpy")
def _meets_ball(balls: Array, x: float, below: float, view_y: float, view_z: float) -> bool:
    """Return whether a ray meets the bounding ball of any object."""
    for thing in range(len(balls)):
        u, v = x - balls[thing, 0], below - balls[thing, 2] * view_y + balls[thing, 1] * view_z
        if u * u + v * v < balls[thing, 3] * balls[thing, 3]:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _cast(
    solids: Array, balls: Array, corner: Array, step: float, width: int, height: int,
    pitch: float, light: Array, shaded: bool,
) -> tuple[NDArray[np.int64], Array, Array]:  # fmt: skip
    owners = np.full((height, width), NOTHING)
    solid_steepest = np.array([_max_slope(solid) for solid in solids])
    steepest = np.zeros(len(balls))
    for thing in range(len(balls)):
        steepest[thing] = solid_steepest[int(balls[thing, 4]) : int(balls[thing, 5])].max()
    # Lower bounds of distances along a ray: the last measured distance of an object or solid plus
    # its maximum decrease since the start of the ray. Far candidates are not measured again.
    bounds, solid_bounds = np.empty(len(balls)), np.empty(len(solids))
    near_things = np.empty(len(balls), np.int64)
    places = np.zeros((height, width, 3))
    lights = np.zeros((height, width, 2))
    view_y, view_z = np.sin(pitch), np.cos(pitch)  # unit vector to the camera; its x is 0
    facing = _facing_planes(solids, balls, view_y, view_z)
    for row in range(height):
        below = corner[1] + (row + 0.5) * step
        for column in range(width):
            x = corner[0] + (column + 0.5) * step
            if not _meets_ball(balls, x, below, view_y, view_z):
                continue
            y, z = _START * view_y - below * view_z, _START * view_z + below * view_y
            travelled, owner = 0.0, NOTHING
            bounds[:], solid_bounds[:] = -np.inf, -np.inf
            count, last_plane = len(balls), 1e9
            for thing in range(count):
                near_things[thing] = thing
            while travelled < _END:
                if len(facing) and last_plane > 0.02:
                    plane = 1e9
                    for i in facing:
                        plane = min(plane, _distance_to(solids, i, x, y, z))
                    if plane < last_plane / 2:
                        last_plane = plane
                        count = _select_near_objects(
                            balls, near_things, count, x, below, view_y, view_z, plane
                        )
                gap, owner = _distance_along(
                    solids, balls, near_things, count, x, y, z, travelled, owner,
                    bounds, steepest, solid_bounds, solid_steepest,
                )  # fmt: skip
                if gap < 0.02:
                    break
                gap *= 0.9  # the distance to folds is approximate
                travelled += gap
                y, z = y - gap * view_y, z - gap * view_z
            if travelled >= _END:
                continue
            owners[row, column] = owner
            places[row, column, 0] = x
            places[row, column, 1] = y
            places[row, column, 2] = z
            if shaded:
                lights[row, column] = _surface_light(solids, balls, x, y, z, light, view_z)
    return owners, places, lights


def cast_rays(
    things: Sequence[Sequence[Array]],
    view: ParallelView,
    corner: tuple[float, float],
    size: tuple[int, int],
    fine: int,
    shaded: bool = True,
) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the visible objects and their light, sample by sample.

    `things` are objects, which are lists of solids. `corner` is the upper left corner of the image
    relative to the origin, `size` its width and height [pixels], and `fine` the number of samples
    per pixel and axis. Returns three arrays over the samples: the index of the visible
    object or `NOTHING`, the point on its surface (3) [pixels], and the light (2). The light
    consists of the light on the surface and the reflection of the lamp, which is 1 for a mirror. It
    takes most of the time and is 0 unless `shaded`.
    """
    solids, balls = pack_objects(things)
    seen: tuple[NDArray[np.int64], Array, Array] = _cast(
        solids, balls, np.asarray(corner, np.float64), 1 / fine, fine * size[0], fine * size[1],
        view.pitch, np.asarray(view.light), shaded,
    )  # fmt: skip
    return seen
