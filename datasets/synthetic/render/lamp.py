"""Lamps: light on surfaces, occlusion of light, soft shadows.

Points are image column, image row and depth [pixels]. Depth is positive towards the camera. Light
is linear.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Array

Floats = NDArray[np.floating]

REACH = 400.0  # distance at which the light of a lamp of power 1 on a facing surface is 1 [pixels]
RADIUS = 22.0  # radius of a lamp's shade [pixels]
AMBIENT = 0.16  # fraction of a lamp's light that arrives by reflection from other walls of the room
FAINT = 1e-4  # coverage that is too small to be visible or to determine a normal

# number of points of a lamp that emit rays, and step length along a ray [pixels]
SPOTS, STRIDE = 10, 1.8


@dataclass(frozen=True)
class Lamp:
    """Lamp with a shade."""

    place: Array  # (3,)
    colour: Array  # (3,), power in blue, green and red


@njit(cache=True)
def lamp_light(place: Array, point: Array, normal: Array) -> tuple[float, float]:
    """Return the diffuse light of a lamp on a surface, and its mirror reflection.

    Both values are 1 for a lamp of power 1 directly in front of the surface at the distance
    `REACH`. `normal` has the length 1.
    """
    u, v, w = place[0] - point[0], place[1] - point[1], place[2] - point[2]
    distance = np.sqrt(u * u + v * v + w * w)
    facing = (u * normal[0] + v * normal[1] + w * normal[2]) / distance
    if facing <= 0:
        return 0.0, 0.0
    half = facing + normal[2]  # along the direction half-way between lamp and camera
    half /= np.sqrt((u * u + v * v) / (distance * distance) + (w / distance + 1) ** 2)
    power = (REACH / distance) ** 2
    return facing * power, max(half, 0.0) ** 40 * power


def plane_crossings(lamp: Lamp, points: Floats, depth: float) -> Floats:
    """Return columns and rows [pixels] at which the rays from a lamp to points cross a plane.

    `depth` is the depth of the plane [pixels]. If, as seen from the lamp, the plane is behind a
    point, the result for this point is far outside the image.
    """
    place = lamp.place.astype(points.dtype)
    share = (depth - points[..., 2:]) / (place[2] - points[..., 2:])
    through = points[..., :2] + (place[:2] - points[..., :2]) * share
    return np.where(share > 0, through, -1e4).astype(points.dtype)


def shadow_softness(lamp: Lamp, depth: float, behind: float) -> float:
    """Return the blur [pixels] of an object at `depth` for a soft shadow at depth `behind`."""
    return float(RADIUS / 2 * (depth - behind) / (lamp.place[2] - behind))


def lamp_visibility(depths: Array, place: Array, fine: int) -> Array:
    """Return the fraction of a lamp that is visible from a surface, shape (h, w, 1).

    `depths`, shape (h, w), are the depths of a solid surface, positive towards the camera [pixels].
    The surface has `fine` samples per pixel along each axis.
    """
    turns = np.arange(SPOTS) * 2.399963  # golden angle
    spread = RADIUS * np.sqrt((np.arange(SPOTS) + 0.5) / SPOTS)
    spots = np.stack([spread * np.cos(turns), spread * np.sin(turns)], axis=1)
    return np.asarray(_lamp_visibility(depths, place, fine, spots))[..., None]


@njit(cache=True)
def _lamp_visibility(depths: Array, place: Array, fine: int, spots: Array) -> Array:
    height, width = depths.shape
    highest = depths.max()
    # Maximum depth in each of the four quadrants around a sample; a ray stays in one quadrant.
    farther = np.empty((2, 2, height, width))
    for down in range(2):
        for right in range(2):
            maximum = farther[down, right]
            for j in range(height):
                row = height - 1 - j if down else j
                for i in range(width):
                    column = width - 1 - i if right else i
                    deepest = depths[row, column]
                    if i > 0:
                        deepest = max(deepest, maximum[row, column + 1 if right else column - 1])
                    if j > 0:
                        deepest = max(deepest, maximum[row + 1 if down else row - 1, column])
                    maximum[row, column] = deepest
    visible_spots = np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            for k in range(len(spots)):
                x, y, z = float(column), float(row), depths[row, column] + 0.8
                u = (place[0] + spots[k, 0]) * fine - x
                v = (place[1] + spots[k, 1]) * fine - y
                w = place[2] - z
                step = STRIDE * fine / np.sqrt(u * u + v * v + (w * fine) ** 2)
                u, v, w = u * step, v * step, w * step
                clear = 1.0
                end = farther[int(v >= 0), int(u >= 0), row, column] if w > 0 else highest
                while z < end:
                    x, y, z = x + u, y + v, z + w
                    across, down = int(x + 0.5), int(y + 0.5)
                    if not (0 <= across < width and 0 <= down < height):
                        break
                    if depths[down, across] > z:
                        clear = 0.0
                        break
                visible_spots[row, column] += clear
    return visible_spots / len(spots)


@njit(cache=True)
def surface_light(place: Array, depth: Array, normal: Array, fine: int) -> tuple[Array, Array]:
    """Return the diffuse and the mirrored light of a lamp on a static surface, for all samples."""
    light, shine = np.empty(depth.shape), np.empty(depth.shape)
    point = np.empty(3)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            point[0], point[1] = (column + 0.5) / fine, (row + 0.5) / fine
            point[2] = depth[row, column]
            light[row, column], shine[row, column] = lamp_light(place, point, normal[row, column])
    return light, shine


@njit(cache=True)
def blend_lit_card(
    picture: Floats, colour: Floats, normal: Floats, depth: float, turn: Array,
    places: Array, powers: Array, visible: Floats,
) -> None:  # fmt: skip
    """Blend a lit card over an image in place.

    `visible`, shape (lamps, height, width), is the share of each lamp visible from the card.
    """
    point, facing = np.empty(3), np.empty(3)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            covered = colour[row, column, 3]
            if covered < FAINT:
                continue
            for c in range(3):
                facing[c] = normal[row, column, c] / covered
                picture[row, column, c] *= 1 - covered
            facing[0] += turn[0]
            facing[1] += turn[1]
            length = np.sqrt(facing[0] ** 2 + facing[1] ** 2 + facing[2] ** 2)
            for c in range(3):
                facing[c] /= length
            point[0], point[1], point[2] = column + 0.5, row + 0.5, depth
            for k in range(len(places)):
                light, shine = lamp_light(places[k], point, facing)
                light = AMBIENT + light * visible[k, row, column]
                shine *= normal[row, column, 3] * visible[k, row, column]
                for c in range(3):
                    back = colour[row, column, c] * light + shine
                    picture[row, column, c] += back * powers[k, c]


COARSE = 4  # pixels per shadow sample and axis


def remaining_light(
    coverage: NDArray[np.float32], shift: Array, shadow_softness: float, darkness: float
) -> NDArray[np.float32]:
    """Return the fraction of light behind an object, shape (height, width, 3), in [0, 1].

    `coverage` is the fraction of each pixel that the object covers; its height and width are
    multiples of `COARSE`. `shift` is the vector from the object to its shadow, `shadow_softness`
    the standard deviation of the shadow's blur [pixels], and `darkness` the fraction of light that
    the shadow removes.
    """
    size = coverage.shape[1], coverage.shape[0]
    coarse = size[0] // COARSE, size[1] // COARSE
    small = cv2.resize(coverage, coarse, interpolation=cv2.INTER_AREA)
    matrix = np.column_stack([np.eye(2), shift / COARSE])
    moved = np.asarray(cv2.warpAffine(small, matrix, coarse))
    left = 1 - np.float32(darkness) * cv2.GaussianBlur(moved, (0, 0), shadow_softness / COARSE)
    return np.asarray(cv2.resize(cv2.merge([left] * 3), size, interpolation=cv2.INTER_LINEAR))
