"""Round cones, seen from far: what limbs and fingers are made of.

A cone joins two balls. Only sums, products and square roots of numbers that are rounded
before: the same bytes on every platform.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

COLUMNS = 14
"""Of a cone: its two ends, x to the right, y down, z towards the camera, and radius, [pixels];
then `BLUE` and the two after it, `CREASE`, `MATERIAL` and whether its second end is flat."""

BLUE, CREASE, MATERIAL, FLAT = 8, 11, 12, 13
"""Columns of its colour, BGR in [0, 255], of how dark the crease at its first end is, of its
material (`SKIN` or `CLOTH`: what lies beside one another of the same flows together)."""

SKIN, CLOTH = 0, 1

FINE = 4
"""Samples a pixel, in either direction."""

TRAVEL = 1.5
"""What moves farther than this during the exposure is cut off [pixels]."""

MELT = 1.1
"""Depth over which surfaces of one material flow together [pixels]."""


@njit(cache=True, error_model="numpy")
def _there(cones: NDArray[np.float64], column: int, row: int) -> NDArray[np.int64]:
    """Cones that a pixel may show during the exposure."""
    found = np.empty(len(cones), np.int64)
    count = 0
    for i in range(len(cones)):
        reach = max(cones[i, 3], cones[i, 7]) + 0.5 + TRAVEL
        x, y = column + 0.5, row + 0.5
        if (
            min(cones[i, 0], cones[i, 4]) - reach < x < max(cones[i, 0], cones[i, 4]) + reach
            and min(cones[i, 1], cones[i, 5]) - reach < y < max(cones[i, 1], cones[i, 5]) + reach
        ):
            found[count] = i
            count += 1
    return found[:count]


@njit(cache=True, error_model="numpy", inline="always")
def _height(cones: NDArray[np.float64], i: int, x: float, y: float) -> tuple[float, float]:
    """How near the surface of a cone is to the camera, and where along the cone (0 to 1).

    The first is -1e9 beside the cone.
    """
    along_x, along_y = cones[i, 4] - cones[i, 0], cones[i, 5] - cones[i, 1]
    from_x, from_y = x - cones[i, 0], y - cones[i, 1]
    place = (from_x * along_x + from_y * along_y) / (along_x * along_x + along_y * along_y + 1e-6)
    if place > 1.0 and cones[i, FLAT] > 0.0:
        return -1e9, 1.0
    place = min(max(place, 0.0), 1.0)
    radius = cones[i, 3] + place * (cones[i, 7] - cones[i, 3])
    off_x, off_y = from_x - place * along_x, from_y - place * along_y
    square = radius * radius - off_x * off_x - off_y * off_y
    if square <= 0.0:
        return -1e9, place
    return cones[i, 2] + place * (cones[i, 6] - cones[i, 2]) + math.sqrt(square), place


@njit(cache=True, error_model="numpy", inline="always")
def _nearest(
    cones: NDArray[np.float64],
    there: NDArray[np.int64],
    x: float,
    y: float,
    heights: NDArray[np.float64],
    places: NDArray[np.float64],
) -> int:
    """Cone, of those that are there, whose surface is seen at a point, or -1.

    Their `heights` and `places` are filled.
    """
    nearest = -1
    for i in there:
        heights[i], places[i] = _height(cones, i, x, y)
        if heights[i] > -1e8 and (nearest < 0 or heights[i] > heights[nearest]):
            nearest = i
    return nearest


@njit(cache=True, error_model="numpy")
def cover(cones: NDArray[np.float64], material: int, height: int, width: int) -> NDArray[np.int64]:
    """How many of a pixel's samples, of `FINE` * `FINE`, show a material; shape (height, width).

    `cones` has a row of `COLUMNS` numbers for each; `material` is `SKIN` or `CLOTH`.
    """
    samples = np.zeros((height, width), np.int64)
    heights, places = np.empty(len(cones)), np.empty(len(cones))
    for row in range(height):
        for column in range(width):
            there = _there(cones, column, row)
            for sample in range(FINE * FINE if len(there) else 0):
                x, y = column + (sample % FINE + 0.5) / FINE, row + (sample // FINE + 0.5) / FINE
                seen = _nearest(cones, there, x, y, heights, places)
                if seen >= 0 and cones[seen, MATERIAL] == material:
                    samples[row, column] += 1
    return samples


@njit(cache=True, error_model="numpy")
def paint(
    canvas: NDArray[np.uint8],
    moments: NDArray[np.float64],
    frames: NDArray[np.float64],
    textures: NDArray[np.float64],
    lamp: NDArray[np.float64],
) -> None:
    """Lay cones over a picture in place, blurred by their motion.

    Each sample of a pixel has its own of the `moments` of the exposure, shape (FINE, m, COLUMNS).
    `frames`, shape (FINE, 2, 4), says for each moment and material where texel (0, 0) lies [pixels]
    and how many texels right and down the picture moves on by a pixel to the right; a pixel down is
    at right angles to it. `textures`, shape (2, 2**k, 2**k), are periodic gains of light for each
    material; `lamp` is the direction to the light, and the light where none of it falls.
    """
    height, width = canvas.shape[:2]
    count, size = moments.shape[1], textures.shape[1]
    heights, places = np.empty(count), np.empty(count)
    sums = np.empty(3)
    for row in range(height):
        for column in range(width):
            there = _there(moments[FINE // 2], column, row)
            sums[:] = 0.0
            covered = 0
            for sample in range(FINE * FINE if len(there) else 0):
                down, across = sample // FINE, sample % FINE
                moment = (2 * down + across + down // 2) % FINE
                cones = moments[moment]
                x, y = column + (across + 0.5) / FINE, row + (down + 0.5) / FINE
                seen = _nearest(cones, there, x, y, heights, places)
                if seen < 0:
                    continue
                covered += 1
                material = int(cones[seen, MATERIAL])
                frame = frames[moment, material]
                u = (x - frame[0]) * frame[2] + (y - frame[1]) * frame[3]
                v = (y - frame[1]) * frame[2] - (x - frame[0]) * frame[3]
                texel = textures[material, math.floor(v) & (size - 1), math.floor(u) & (size - 1)]
                _add(sums, cones, there, seen, x, y, heights, places, lamp, texel)
            if covered:
                for c in range(3):
                    value = sums[c] + canvas[row, column, c] * (FINE * FINE - covered)
                    canvas[row, column, c] = min(int(value / (FINE * FINE) + 0.5), 255)


@njit(cache=True, error_model="numpy", inline="always")
def _add(
    sums: NDArray[np.float64],
    cones: NDArray[np.float64],
    there: NDArray[np.int64],
    seen: int,
    x: float,
    y: float,
    heights: NDArray[np.float64],
    places: NDArray[np.float64],
    lamp: NDArray[np.float64],
    texel: float,
) -> None:
    """Add the colour of a sample: what is nearly as near as the nearest flows into it."""
    normal_x, normal_y, normal_z, total, fold = 0.0, 0.0, 0.0, 0.0, 0.0
    blue, green, red = 0.0, 0.0, 0.0
    for i in there:
        share = 1.0 - (heights[seen] - heights[i]) / MELT
        if share <= 0.0 or cones[i, MATERIAL] != cones[seen, MATERIAL]:
            continue
        share *= share
        p = places[i]
        radius = cones[i, 3] + p * (cones[i, 7] - cones[i, 3])
        normal_x += share * (x - cones[i, 0] - p * (cones[i, 4] - cones[i, 0])) / radius
        normal_y += share * (y - cones[i, 1] - p * (cones[i, 5] - cones[i, 1])) / radius
        normal_z += share * (heights[i] - cones[i, 2] - p * (cones[i, 6] - cones[i, 2])) / radius
        blue += share * cones[i, BLUE]
        green += share * cones[i, BLUE + 1]
        red += share * cones[i, BLUE + 2]
        fold += share * cones[i, CREASE] * max(0.0, 1.0 - 5.0 * p)
        total += share
    length = math.sqrt(normal_x * normal_x + normal_y * normal_y + normal_z * normal_z) + 1e-9
    towards = (lamp[0] * normal_x + lamp[1] * normal_y + lamp[2] * normal_z) / length
    # Like a hall's: what faces sideways still gets half of it; what lies deep gets little.
    light = lamp[3] + (1.0 - lamp[3]) * (0.5 + 0.5 * towards)
    light *= (0.72 + 0.28 * normal_z / length) * (1.0 - fold / total) * texel / total
    sums[0] += min(blue * light, 255.0)
    sums[1] += min(green * light, 255.0)
    sums[2] += min(red * light, 255.0)
