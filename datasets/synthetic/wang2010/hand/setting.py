"""Renderer of round cones, and the office with a seated person behind the hand.

Limbs and fingers consist of round cones; a cone is the hull of two balls. Coordinates are rounded
and the renderer uses only sums, products and square roots, so that all platforms give the same
bytes. No object in the room has the hue of skin.
"""

import math
from dataclasses import replace
from functools import partial

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.colours import BGR, sample_colour
from trackmark.datasets.synthetic.render.figure.look import Cut, FigureLook, sample_figure_look
from trackmark.datasets.synthetic.render.figure.routine import Routine
from trackmark.datasets.synthetic.render.figure.worker import Worker
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.texture import fractal, lerp, ramp

COLUMNS = 14
"""Number of columns of a cone.

The first eight are x (right), y (down), z (towards the camera) and radius of both ends [pixels].
"""

BLUE, CREASE, MATERIAL, FLAT = 8, 11, 12, 13
"""Indices of further columns of a cone.

`BLUE` is the first of three columns with the colour, BGR in [0, 255]. `CREASE` is the darkness of
the crease at the first end. `MATERIAL` is `SKIN` or `CLOTH`; adjacent cones of one material merge.
`FLAT` is 1 if the second end is flat.
"""

SKIN, CLOTH = 0, 1

GRID = 4  # samples per pixel and axis
TRAVEL = 1.5  # maximum motion during the exposure; larger motion is clipped [pixels]
MELT = 1.1  # difference in depth over which surfaces of one material merge [pixels]


@njit(cache=True, error_model="numpy")
def _candidates(cones: Array, column: int, row: int) -> NDArray[np.int64]:
    indices = np.empty(len(cones), np.int64)
    count = 0
    for i in range(len(cones)):
        reach = max(cones[i, 3], cones[i, 7]) + 0.5 + TRAVEL
        x, y = column + 0.5, row + 0.5
        if (
            min(cones[i, 0], cones[i, 4]) - reach < x < max(cones[i, 0], cones[i, 4]) + reach
            and min(cones[i, 1], cones[i, 5]) - reach < y < max(cones[i, 1], cones[i, 5]) + reach
        ):
            indices[count] = i
            count += 1
    return indices[:count]


@njit(cache=True, error_model="numpy", inline="always")
def _surface_depth(cones: Array, i: int, x: float, y: float) -> tuple[float, float]:
    """Return depth (-1e9 outside) and position along a cone, in [0, 1], at an image point."""
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
    cones: Array,
    candidates: NDArray[np.int64],
    x: float,
    y: float,
    heights: Array,
    places: Array,
) -> int:
    """Return the visible cone at a point, or -1; write depths and positions of all candidates."""
    nearest = -1
    for i in candidates:
        heights[i], places[i] = _surface_depth(cones, i, x, y)
        if heights[i] > -1e8 and (nearest < 0 or heights[i] > heights[nearest]):
            nearest = i
    return nearest


@njit(cache=True, error_model="numpy")
def cover(cones: Array, material: int, height: int, width: int) -> NDArray[np.int64]:
    """Count the samples of each pixel, of `GRID` * `GRID`, in which a material is visible.

    `cones` has a row of `COLUMNS` numbers per cone. `material` is `SKIN` or `CLOTH`. The result has
    the shape (height, width).
    """
    samples = np.zeros((height, width), np.int64)
    heights, places = np.empty(len(cones)), np.empty(len(cones))
    for row in range(height):
        for column in range(width):
            candidates = _candidates(cones, column, row)
            for sample in range(GRID * GRID if len(candidates) else 0):
                x, y = column + (sample % GRID + 0.5) / GRID, row + (sample // GRID + 0.5) / GRID
                seen = _nearest(cones, candidates, x, y, heights, places)
                if seen >= 0 and cones[seen, MATERIAL] == material:
                    samples[row, column] += 1
    return samples


@njit(cache=True, error_model="numpy")
def paint(
    canvas: NDArray[np.uint8],
    moments: Array,
    frames: Array,
    textures: Array,
    lamp: Array,
) -> None:
    """Paint cones over an image in place, blurred by their motion.

    `moments`, shape (GRID, m, COLUMNS), are the cones at GRID times of the exposure; each sample of
    a pixel uses one of these times. `frames`, shape (GRID, 2, 4), are the positions of the textures
    by time and material. A row contains column and row of texel (0, 0) in the image, and the steps
    in texels (right, down) per pixel to the right. `textures`, shape (2, 2**k, 2**k), are periodic
    light gains by material. `lamp` is the direction to the light and the ambient light.
    """
    height, width = canvas.shape[:2]
    count, size = moments.shape[1], textures.shape[1]
    heights, places = np.empty(count), np.empty(count)
    sums = np.empty(3)
    for row in range(height):
        for column in range(width):
            candidates = _candidates(moments[GRID // 2], column, row)
            sums[:] = 0.0
            covered = 0
            for sample in range(GRID * GRID if len(candidates) else 0):
                down, across = sample // GRID, sample % GRID
                moment = (2 * down + across + down // 2) % GRID
                cones = moments[moment]
                x, y = column + (across + 0.5) / GRID, row + (down + 0.5) / GRID
                seen = _nearest(cones, candidates, x, y, heights, places)
                if seen < 0:
                    continue
                covered += 1
                material = int(cones[seen, MATERIAL])
                frame = frames[moment, material]
                u = (x - frame[0]) * frame[2] + (y - frame[1]) * frame[3]
                v = (y - frame[1]) * frame[2] - (x - frame[0]) * frame[3]
                texel = textures[material, math.floor(v) & (size - 1), math.floor(u) & (size - 1)]
                _add_sample(sums, cones, candidates, seen, x, y, heights, places, lamp, texel)
            if covered:
                for c in range(3):
                    value = sums[c] + canvas[row, column, c] * (GRID * GRID - covered)
                    canvas[row, column, c] = min(int(value / (GRID * GRID) + 0.5), 255)


@njit(cache=True, error_model="numpy", inline="always")
def _add_sample(
    sums: Array,
    cones: Array,
    candidates: NDArray[np.int64],
    seen: int,
    x: float,
    y: float,
    heights: Array,
    places: Array,
    lamp: Array,
    texel: float,
) -> None:
    """Add the colour of a sample to a pixel; surfaces of similar depth are blended."""
    normal_x, normal_y, normal_z, total, fold = 0.0, 0.0, 0.0, 0.0, 0.0
    blue, green, red = 0.0, 0.0, 0.0
    for i in candidates:
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
    # Diffuse light of a room: surfaces perpendicular to the light receive half of it.
    light = lamp[3] + (1.0 - lamp[3]) * (0.5 + 0.5 * towards)
    light *= (0.72 + 0.28 * normal_z / length) * (1.0 - fold / total) * texel / total
    sums[0] += min(blue * light, 255.0)
    sums[1] += min(green * light, 255.0)
    sums[2] += min(red * light, 255.0)


FINE = 4  # supersampling per axis
SCALE = 110.0  # scale on the wall [pixels/metre]
SIDE = 512

WALLS = ((196, 186, 168), (176, 184, 164), (192, 176, 170), (204, 190, 172), (168, 166, 152))
FURNITURE = ((128, 116, 100), (150, 142, 128), (104, 86, 66), (98, 112, 82), (206, 198, 186))
BACKS = (
    (120, 66, 34), (86, 48, 36), (150, 116, 70), (66, 98, 46), (92, 110, 40), (110, 54, 92),
    (60, 56, 52), (212, 206, 198), (158, 150, 140), (48, 40, 132), (70, 184, 196),
)  # fmt: skip
PAPERS = ((222, 214, 202), (216, 204, 184), (146, 216, 224), (200, 228, 196))
LEAVES = ((46, 92, 40), (58, 116, 52), (44, 74, 34), (70, 130, 76))
SEAS = np.array([[92, 62, 34], [146, 108, 58], [190, 172, 132], [222, 214, 200]], np.float64)

_sample_paint = partial(sample_colour, spread=0.05)  # small variation, which preserves the hue


def office(random: Generator, width: int, height: int) -> Image:
    """Return an image of a wall with a shelf, a picture, a cupboard, and a plant or a pinboard."""
    wall = _wall(random, width, height)
    across, up = width / SCALE, height / SCALE
    painting = Painting(wall, SCALE * FINE)
    left = bool(random.random() < 0.5)
    _rail(painting, up, across, random)
    _cupboard(painting, random, across, up, left)
    _shelf(painting, random, across, left)
    _framed_picture(painting, random, 0.10 if left else across - 0.50, random.uniform(0.07, 0.14))
    if random.random() < 0.5:
        _plant(painting, random, 0.16 if left else across - 0.16, up)
    else:
        _pinboard(painting, random, 0.06 if left else across - 0.36, 0.56)
    return _reduced(wall)


def _wall(random: Generator, width: int, height: int) -> Image:
    """Return a painted wall with grain and blotches, lighter towards a window on one side."""
    tone = 1 + 0.025 * fractal(random, SIDE, 32, 256, 0.9) + 0.03 * fractal(random, SIDE, 2, 16)
    tone = np.tile(tone, (1, 2))[: height * FINE, : width * FINE]
    aside = np.linspace(-1, 1, width * FINE) * random.choice([-1, 1])
    tone = tone * (1 + 0.10 * aside) * (1 - 0.06 * np.linspace(-1, 1, height * FINE)[:, None])
    paint = _sample_paint(random, WALLS)
    return np.asarray(np.clip(np.round(paint * tone[..., None]), 0, 255), np.uint8)


def _reduced(picture: Image) -> Image:
    """Downsample an image and blur it slightly, like a lens."""
    rows, columns = picture.shape[0] // FINE, picture.shape[1] // FINE
    blocks = picture.reshape(rows, FINE, columns, FINE, 3).sum(axis=(1, 3), dtype=np.int64)
    padded = np.pad(blocks, ((1, 1), (1, 1), (0, 0)), mode="edge")
    across = padded[:, :-2] + 4 * padded[:, 1:-1] + padded[:, 2:]
    both = across[:-2] + 4 * across[1:-1] + across[2:]
    total = 36 * FINE * FINE
    return np.asarray((both + total // 2) // total, np.uint8)


def _rail(painting: Painting, up: float, across: float, random: Generator) -> None:
    y = up - random.uniform(0.16, 0.24)
    painting.plate(-0.1, y, across + 0.2, 0.07, (206, 200, 190), 0.008)
    for x in random.uniform(0.1, across - 0.2, 2):
        painting.plate(x, y + 0.008, 0.055, 0.054, (226, 220, 212), 0.004)
        painting.disc(x + 0.027, y + 0.035, 0.012, (120, 114, 106))


def _cupboard(painting: Painting, random: Generator, across: float, up: float, left: bool) -> None:
    colour = _sample_paint(random, FURNITURE)
    width, top = random.uniform(0.40, 0.50), random.uniform(0.56, 0.66)
    x = across - width + 0.04 if left else -0.04
    _binders(painting, random, x + 0.05, top, width * 0.6)
    painting.plate(x, top, width, up, colour, 0.016)
    painting.darken(x + width / 2 - 0.003, top + 0.012, 0.006, up, 0.55)
    for side in (-1, 1):
        painting.plate(
            x + width / 2 + side * 0.035 - 0.008, top + 0.13, 0.016, 0.09, (150, 148, 144), 0.006
        )


def _shelf(painting: Painting, random: Generator, across: float, left: bool) -> None:
    width, y = random.uniform(0.38, 0.48), random.uniform(0.33, 0.40)
    x = across - width - 0.02 if left else 0.02
    books = Painting(painting.picture, painting.scale, x + 0.02, y)
    place = 0.0
    while place < width - 0.09:
        thick, high = random.uniform(0.018, 0.042), random.uniform(0.15, 0.235)
        if random.random() < 0.12:
            place += 0.03
            continue
        back = _sample_paint(random, BACKS)
        books.plate(place, -high, thick, high, back, 0.005)
        books.patch(place + 0.003, -high * 0.82, thick - 0.006, 0.014, back * 0.4 + 130)
        books.patch(place + 0.003, -high * 0.22, thick - 0.006, 0.007, back * 0.6 + 60)
        place += thick + 0.002
    painting.plate(x, y, width, 0.022, _sample_paint(random, FURNITURE), 0.012)
    painting.darken(x + 0.01, y + 0.022, width, 0.05, 0.84)


def _binders(painting: Painting, random: Generator, x: float, bottom: float, width: float) -> None:
    end = x + width
    while x < end:
        back = _sample_paint(random, BACKS[:6])
        painting.plate(x, bottom - 0.125, 0.038, 0.125, back, 0.006)
        painting.patch(x + 0.008, bottom - 0.10, 0.022, 0.045, (222, 216, 208))
        x += 0.041


def _framed_picture(painting: Painting, random: Generator, x: float, y: float) -> None:
    width, height, rim = random.uniform(0.30, 0.38), random.uniform(0.22, 0.28), 0.018
    painting.plate(
        x, y, width, height, _sample_paint(random, ((46, 42, 40), (112, 102, 90))), 0.014
    )
    painting.patch(x + rim, y + rim, width - 2 * rim, height - 2 * rim, (220, 216, 208))
    mat = 2.2 * rim
    top, start = (round((place + mat) * painting.scale) for place in (y, x))
    bottom = round((y + height - mat) * painting.scale)
    finish = round((x + width - mat) * painting.scale)
    view = painting.picture[top:bottom, start:finish]
    rows, columns = view.shape[:2]
    rough = fractal(random, 256, 4, 64, 0.6)
    line = np.linspace(1, -1, rows)[:, None] + 0.25 * rough[:rows, :columns]
    hills = np.linspace(-1, 1, rows)[:, None] - 0.35 * rough[60, :columns] - 0.05
    land = ramp(rough[:rows, :columns], np.array(LEAVES, np.float64))
    view[:] = np.clip(lerp(ramp(line, SEAS), land, 30 * hills), 0, 255).astype(np.uint8)


def _plant(painting: Painting, random: Generator, x: float, up: float) -> None:
    for _ in range(38):
        angle, length = random.uniform(-1.0, 1.0), random.uniform(0.16, 0.46)
        bow = random.uniform(0.02, 0.10) * np.sign(angle)
        t = np.linspace(0, 1, 12)
        along = x + length * np.sin(angle) * t + bow * t * t
        high = up + 0.02 - length * np.cos(angle) * t + 0.12 * abs(angle) * t * t
        wide = 0.016 * np.sin(np.pi * np.clip(t, 0.04, 0.98)) + 0.001
        edge = list(zip((along - wide).tolist(), high.tolist(), strict=True))
        back = list(zip((along + wide).tolist(), high.tolist(), strict=True))[::-1]
        painting.area(edge + back, _sample_paint(random, LEAVES) * random.uniform(0.75, 1.25))
        painting.line(list(zip(along.tolist(), high.tolist(), strict=True)), 0.003, (84, 146, 96))


def _pinboard(painting: Painting, random: Generator, x: float, y: float) -> None:
    painting.plate(x, y, 0.30, 0.26, _sample_paint(random, ((120, 92, 62), (88, 104, 74))), 0.010)
    for column in range(3):
        for row in range(2):
            if random.random() < 0.8:
                painting.label(
                    random, x + 0.02 + 0.09 * column + random.uniform(0, 0.012),
                    y + 0.02 + 0.12 * row + random.uniform(0, 0.015),
                    0.068, random.uniform(0.07, 0.095), paper=_sample_paint(random, PAPERS),
                )  # fmt: skip


DISTANCE = 1.6  # distance from the camera [metres]
HEAD = 0.222  # height of the head from chin to crown [metres]
CROWN = 0.118  # height of the crown above the centre of the head [metres]
BELOW = 0.022  # distance of the face's centre below the head's centre [metres]
CLOTHES: tuple[BGR, ...] = (
    (84, 52, 38),  # navy
    (120, 78, 48),  # blue
    (146, 118, 86),  # light blue
    (112, 106, 96),  # grey
    (74, 92, 60),  # green
    (98, 96, 36),  # teal
    (96, 54, 78),  # violet
)
SHIRTS: tuple[BGR, ...] = ((214, 208, 200), (176, 150, 118), (150, 142, 130), (82, 74, 66))

CUTS: tuple[Cut, ...] = ("short", "short", "full", "full", "wreath")


def sample_person(random: Generator) -> FigureLook:
    """Sample a clean-shaven person whose clothes do not have the colour of skin."""
    return replace(
        sample_figure_look(random),
        cut=CUTS[random.integers(len(CUTS))],
        beard=False,
        bib=False,
        clothes=CLOTHES[random.integers(len(CLOTHES))],
        shirt=SHIRTS[random.integers(len(SHIRTS))],
    )


def portrait(
    random: Generator, look: FigureLook, lamp: Array, head: float, size: tuple[int, int]
) -> Sprite:
    """Render head and shoulders of a person with the face in the centre.

    `lamp` is as in `Worker`. `head` is the height of the head and `size` the width and height of
    the result, both in image pixels; the result has `FINE` samples per pixel and axis.
    """
    width, height = (FINE * length for length in size)
    focal = head * FINE / HEAD * DISTANCE
    eye = look.stature - CROWN
    camera = np.array([focal, width / 2, height / 2, eye - BELOW])
    sitter = Worker(look, _sitting(random, look, eye), camera, lamp, int(random.integers(2**32)))
    black, white = (
        np.zeros((height, width, 3), np.uint8),
        np.full((height, width, 3), 255, np.uint8),
    )
    for canvas in (black, white):
        sitter.draw(canvas, 0, 1.0, 0.0)
    # Pixels that differ between a black and a white background are not covered.
    coverage = 1 - (white.astype(np.float64) - black).mean(axis=2) / 255
    return Sprite(black / np.maximum(coverage, 1 / 255)[..., None], coverage)


def _sitting(random: Generator, look: FigureLook, eye: float) -> Routine:
    """Return a routine of two equal frames: the person faces the camera with hanging arms."""
    ahead = np.pi / 2
    heading, turn = ahead + np.radians(random.uniform(-14, 14, 2) * [1.0, 0.6])
    nod, tilt = np.radians(random.uniform(-4, 4, 2))
    unit = np.ones(2)
    hands = np.array([[[0.30, -0.55, 0.10], [-0.30, -0.55, 0.10]]] * 2)
    return Routine(
        x=0 * unit, z=DISTANCE * unit, crouch=0 * unit, heading=heading * unit, lean=0.04 * unit,
        turn=turn * unit, nod=nod * unit, tilt=tilt * unit, hands=hands, to_face=np.zeros((2, 2)),
    )  # fmt: skip
