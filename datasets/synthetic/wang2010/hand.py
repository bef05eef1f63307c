"""`wang2010/hand`: a hand crosses a face of its own colour.

The authors recorded 100 frames of 160 x 120 pixels of a moving hand; in frame 49 there is a face
behind the hand. The paper shows frames 10, 38, 49 and 58. All other properties are our choice: the
person, the office, and the path of the hand. The hand enters on one side, passes in front of the
face and leaves on the other side; in frame 49 it is centred on the face. The paper's frame k is
frame k - 1 here.

The hand has closed fingers and a sleeved forearm; the palm faces the camera. The constants describe
a right hand in centimetres: x to the right, y up from the wrist, z towards the camera. Its thumb is
on the right in the image.

Limbs and fingers consist of round cones; a cone is the hull of two balls. Coordinates are rounded
and the renderer uses only sums, products and square roots, so that all platforms give the same
bytes. No object in the room has the hue of skin.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.colours import BGR, sample_colour
from trackmark.datasets.synthetic.render.figure.look import Cut, FigureLook, sample_figure_look
from trackmark.datasets.synthetic.render.figure.routine import Routine
from trackmark.datasets.synthetic.render.figure.worker import Worker
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.texture import fractal, lerp, ramp
from trackmark.datasets.synthetic.render.views import random_wander
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene

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
    black = np.zeros((height, width, 3), np.uint8)
    white = np.full((height, width, 3), 255, np.uint8)
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


TEXTURE_SIDE = 256  # rows and columns of a texture
TEXELS = 10.0  # texels per centimetre
WRIST_ROW = 226  # texture row of the wrist


def hand_textures(random: Generator, side: int) -> Array:
    """Return the light gains of skin and cloth, shape (2, TEXTURE_SIDE, TEXTURE_SIDE); see `paint`.

    `side` is 1 for a right hand and -1 for a left hand.
    """
    y, x = np.indices((TEXTURE_SIDE, TEXTURE_SIDE))
    right, up = (x + 0.5 - TEXTURE_SIDE / 2) / TEXELS * side, (WRIST_ROW - y) / TEXELS
    shift = random.uniform(-0.25, 0.25, 3)
    around = np.hypot(right - 4.3, up - 2.6)  # distance from the ball of the thumb
    life = _line(around - 3.9 - shift[0], 0.22) * (up > 1.2) * (up < 6.6) * (right < 3.4)
    heart = _line(up - 7.6 - shift[1] + 0.09 * np.square(right - 1.6), 0.20)
    heart = heart * (right > -3.6) * (right < 1.6)
    head = _line(up - 5.9 - shift[2] + 0.07 * np.square(right - 2.6), 0.18)
    head = head * (right > -2.4) * (right < 2.8)
    wrist = _line(up - 0.1 - 0.03 * np.square(right), 0.16) * (np.abs(right) < 2.4)
    skin = 1 + 0.035 * fractal(random, TEXTURE_SIDE, 8, 64, 0.8)
    skin = skin * (1 - 0.17 * np.clip(life + heart + 0.8 * head + wrist, 0, 1))
    folds = fractal(random, TEXTURE_SIDE, 8, 32, 0.7)
    cloth = (
        1 + 0.05 * fractal(random, TEXTURE_SIDE, 4, 16) + 0.30 * (folds - np.roll(folds, 3, axis=0))
    )
    return np.stack([skin, cloth + random.normal(0, 0.03, cloth.shape)])


def _line(distance: Array, width: float) -> Array:
    return np.asarray(1 / (1 + np.square(np.square(distance / width))))


FRAMES = 100
CENTRED = 48  # frame in which the hand is centred on the face, which is frame 49 of the paper
FINGERS = 5  # thumb first, little finger last
JOINTS = 3


@dataclass(frozen=True)
class HandPose:
    """Joint angles of a hand in every frame [radians]."""

    tilt: Array  # (n,): angle of the hand, from upright to the right
    arm_tilt: Array  # (n,): angle of the forearm, from upright to the right
    yaw: Array  # (n,): rotation of the palm to the right
    pitch: Array  # (n,): rotation of the fingers towards the camera
    # (FINGERS, n): deviation of each finger from its rest direction, in the plane of the palm
    spread: Array
    bend: Array  # (FINGERS, 3, n): bending of each joint towards the palm


def sample_path(random: Generator, side: int) -> Array:
    """Sample positions relative to the position in frame `CENTRED`, shape (FRAMES, 2) [pixels].

    The hand moves to the right if `side` is 1, and to the left if it is -1. It is faster in the
    middle of the path, so that it does not overlap the face until frame 38 of the paper, and is
    centred on it in frame 49. The path is slightly irregular.
    """
    time = np.arange(FRAMES) - CENTRED
    slow, fast, long = random.uniform(0.88, 0.95), random.uniform(2.15, 2.4), random.uniform(20, 23)
    swell = np.clip(1 - np.square(time / long), 0, None)
    across = np.cumsum(slow + (fast - slow) * swell * swell)
    across += random_wander(random, FRAMES, (1.2, 3.5), 0.5)
    sag = random.uniform(3, 7) * np.square(time / CENTRED)  # circular arc around the elbow
    lean = random.uniform(-4, 4) * time / CENTRED
    down = sag + lean + random_wander(random, FRAMES, (1.2, 4.0), 1.3)
    path = np.stack([side * across, down], axis=1)
    return np.asarray(path - path[CENTRED])


def sample_pose(random: Generator, path: Array) -> HandPose:
    """Sample a relaxed hand with closed fingers on a path of `sample_path`.

    The tilt of the forearm grows with the distance that it must reach.
    """

    def wave(periods: tuple[float, float], degrees: float) -> Array:
        return np.radians(random_wander(random, FRAMES, periods, degrees))

    reach = path[:, 0] / np.abs(path[:, 0]).max()
    arm_tilt = np.radians(random.uniform(6, 11)) * reach + wave((2.0, 5.0), 1.5)
    tilt = np.radians(random.uniform(1, 3)) * reach + wave((1.2, 3.5), 1.2)
    rest = np.radians(random.uniform(8, 17, (FINGERS, JOINTS, 1)))
    together = wave((1.5, 4.0), 5.0)
    bends = [[wave((0.9, 2.5), 2.0) for _ in range(JOINTS)] for _ in range(FINGERS)]
    return HandPose(
        tilt,
        arm_tilt,
        np.radians(random.uniform(-14, 14)) + wave((1.5, 4.0), 6.0),
        np.radians(random.uniform(-6, 6)) + wave((1.5, 4.0), 4.0),
        np.array([wave((1.0, 3.0), 0.8) for _ in range(FINGERS)]),
        rest + together + np.array(bends),
    )


# both ends of the bones in the palm with their radii: thumb, then the four fingers
_PALM = (
    ((1.7, 1.9, 0.3), (3.4, 4.9, 0.9), 1.55, 1.15),
    ((1.3, 1.5, 0.0), (2.9, 9.2, 0.0), 1.55, 1.15),
    ((0.4, 1.4, 0.0), (0.8, 9.6, 0.1), 1.50, 1.15),
    ((-0.5, 1.4, 0.0), (-1.2, 9.2, 0.0), 1.50, 1.10),
    ((-1.4, 1.5, 0.0), (-3.0, 8.2, -0.1), 1.45, 1.00),
)
_PADS = (
    ((1.6, 2.6, 0.55), (2.6, 4.8, 0.55), 1.55, 1.20),  # ball of the thumb
    ((-1.7, 2.3, 0.35), (-2.3, 5.4, 0.30), 1.50, 1.15),  # ball of the little finger
    ((2.4, 8.7, 0.35), (-2.4, 7.9, 0.30), 0.95, 0.90),  # below the fingers
)
# for each finger: direction [degrees to the right], lengths of bones, radii at their ends
_FINGERS = (
    (6, (3.1, 2.7), (1.15, 1.10, 0.82)),
    (-1, (4.2, 2.5, 2.0), (1.10, 1.02, 0.92, 0.74)),
    (0, (4.6, 2.8, 2.1), (1.12, 1.04, 0.94, 0.76)),
    (1, (4.3, 2.6, 2.1), (1.08, 1.00, 0.90, 0.74)),
    (2, (3.4, 2.0, 1.8), (0.98, 0.88, 0.80, 0.66)),
)
WRIST = 2.45  # half width of the wrist
CUFF = 0.9  # distance from the wrist to the sleeve
CREASED = 0.12  # fraction of light that the crease of a joint removes
FOREARM = 40.0  # length of the forearm, longer than real, so that the elbow is outside the image


@dataclass(frozen=True)
class Hand:
    """Shape of hand and forearm in every frame."""

    cones: Array  # (n, m, COLUMNS), see `COLUMNS`; the cones of the hand come first
    frames: Array  # (n, 2, 4): positions of the textures; see `paint`
    boxes: Array  # (n, 4): boxes of the hand without the sleeve [pixels]


def animate_hand(
    pose: HandPose, path: Array, place: ArrayLike, centred_frame: int, scale: float, side: int,
    skin: ArrayLike, cloth: ArrayLike,
) -> Hand:  # fmt: skip
    """Return a hand on its path, with the centre of its box at `place` in `centred_frame`.

    `path`, shape (n, 2), and `place` are in pixels, `scale` in pixels/centimetre. `side` is 1 for a
    right hand and -1 for a left hand. `skin` and `cloth` are BGR in [0, 255].
    """
    skin, cloth = np.asarray(skin, np.float64), np.asarray(cloth, np.float64)
    turn = _rotations(pose) * [side, 1.0, 1.0]
    bones = _hand_bones(pose, skin)
    parts = [
        _cone(_rotate(turn, bone.root), _rotate(turn, bone.tip), bone.radii, bone.colour,
              SKIN, crease=bone.crease)
        for bone in bones
    ]  # fmt: skip
    down = np.stack([-np.sin(pose.arm_tilt), np.cos(pose.arm_tilt), 0 * pose.tilt], axis=1)
    parts += _forearm(down, skin, cloth)
    cones = np.stack(parts, axis=1)
    cones[..., :BLUE] *= scale
    palm = len(bones)
    edge = CUFF * scale * down
    boxes = _boxes(cones[:, :palm], edge, WRIST * scale * np.abs(down[:, 0]))
    middle = boxes[centred_frame, :2] + boxes[centred_frame, 2:] / 2
    shift = quantised(path - path[centred_frame] + np.asarray(place, np.float64) - middle)
    cones[..., :BLUE] = quantised(cones[..., :BLUE])
    for end in (0, 4):
        cones[..., end : end + 2] += shift[:, None]
    boxes[:, :2] += shift
    frames = np.stack(
        [_texture_frame(shift, tilt, scale) for tilt in (pose.tilt, pose.arm_tilt)], axis=1
    )
    return Hand(cones, frames, boxes)


class _Bone(NamedTuple):
    """Bone of the hand: its two ends in every frame, shape (n, 3), radii and colour."""

    root: Array
    tip: Array
    radii: tuple[float, float]
    colour: Array
    crease: float


def _hand_bones(pose: HandPose, skin: Array) -> list[_Bone]:
    pale, rosy = skin * [1.0, 1.0, 1.02], skin * [0.88, 0.91, 1.03]
    still = np.ones((FRAMES, 1))
    bones = [
        _Bone(still * root, still * tip, (first, last), pale, 0.0)
        for root, tip, first, last in (*_PALM, *_PADS)
    ]
    for finger, (aside, lengths, radii) in enumerate(_FINGERS):
        joint = bones[finger].tip
        across, bent = np.radians(aside) + pose.spread[finger], np.zeros(FRAMES)
        for i, length in enumerate(lengths):
            bent = bent + pose.bend[finger, i]
            flat = np.cos(bent)
            path = np.stack([np.sin(across) * flat, np.cos(across) * flat, np.sin(bent)], axis=1)
            colour = rosy if i == len(lengths) - 1 else (pale + rosy) / 2
            ends = radii[i], radii[i + 1]
            bones.append(_Bone(joint, joint + length * path, ends, colour, CREASED))
            joint = bones[-1].tip
    return bones


def _rotations(pose: HandPose) -> Array:
    """Return rotations (n, 3, 3) from the axes of the hand to the image, whose y points down."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    nothing, unit = np.zeros(FRAMES), np.ones(FRAMES)
    yaw = np.array([[cos, nothing, sin], [nothing, unit, nothing], [-sin, nothing, cos]])
    cos, sin = np.cos(pose.pitch), np.sin(pose.pitch)
    pitch = np.array([[unit, nothing, nothing], [nothing, cos, -sin], [nothing, sin, cos]])
    cos, sin = np.cos(pose.tilt), np.sin(pose.tilt)
    tilt = np.array([[cos, sin, nothing], [sin, -cos, nothing], [nothing, nothing, unit]])
    return np.asarray(np.einsum("ijn,jkn,kln->nil", tilt, pitch, yaw))


def _rotate(turn: Array, points: Array) -> Array:
    return np.asarray((turn * points[:, None, :]).sum(axis=2))


def _cone(
    start: Array, end: Array, radii: ArrayLike, colour: Array, material: int,
    crease: float = 0.0, flat: bool = False,
) -> Array:  # fmt: skip
    cone = np.empty((len(start), COLUMNS))
    cone[:, :3], cone[:, 4:7] = start, end
    cone[:, 3:8:4] = radii
    cone[:, BLUE : BLUE + 3] = colour
    cone[:, CREASE:] = crease, material, flat
    return cone


def _forearm(down: Array, skin: Array, cloth: Array) -> list[Array]:
    """Return the cones of wrist, sleeve and cuff, in this order."""
    aside = np.stack([down[:, 1], -down[:, 0], 0 * down[:, 0]], axis=1)
    back = np.array([0.0, 0.0, 1.0])
    parts = []
    for offset in (-0.85, 0.85):
        start = offset * aside - 0.2 * back
        parts.append(_cone(start - 1.2 * down, start + 4 * down, (1.5, 1.6), skin, SKIN))
    elbow, below = FOREARM * down - 2.0 * back, (CUFF + 0.5) * down - 0.4 * back
    parts.append(_cone(elbow, below, (5.6, 2.95), cloth, CLOTH, flat=True))
    edge = CUFF * down - 0.3 * back
    parts.append(_cone(edge + 2.2 * down, edge, (2.9, 3.1), cloth * 0.84, CLOTH, flat=True))
    return parts


def _boxes(cones: Array, edge: Array, drop: Array) -> Array:
    """Return boxes around the cones of a hand, which ends at its sleeve."""
    balls = np.concatenate([cones[..., :4], cones[..., 4:8]], axis=1)
    low = (balls[..., :2] - balls[..., 3:]).min(axis=1)
    right = (balls[..., 0] + balls[..., 3]).max(axis=1)
    size = np.stack([right - low[:, 0], edge[:, 1] + drop - low[:, 1]], axis=1)
    return np.concatenate([low, size], axis=1)


def _texture_frame(wrist: Array, tilt: Array, scale: float) -> Array:
    """Return the row of `frames` in `paint` for a texture with the wrist at a position."""
    cos, sin = np.cos(tilt), np.sin(tilt)
    left, up = TEXTURE_SIDE / 2 / TEXELS * scale, WRIST_ROW / TEXELS * scale
    x = wrist[:, 0] - left * cos + up * sin
    y = wrist[:, 1] - left * sin - up * cos
    return np.stack([quantised(x), quantised(y), *(TEXELS / scale * np.array([cos, sin]))], axis=1)


SIZE = 160, 120

PORTRAIT = 160, 144  # size of the image of the person, which extends below the image [pixels]
EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
CAMERA = Camera(SIZE, noise=2.2)

# width and height of the face without hair and ears [head heights]
FACE = np.array([0.66, 0.74])
SWAY = 0.25  # standard deviation of the position of the seated person [pixels]


class HandScene(SeededScene):
    """Scene of a hand in front of a face in an office."""

    label, length, size = "wang2010/hand", FRAMES, SIZE

    @cached_property
    def hand(self) -> Hand:
        """Shape of hand and forearm in every frame."""
        random = self._random("way")
        side = self._side
        path = sample_path(random, side)
        pose = sample_pose(random, path)
        middle, head = self._face_position
        skin = np.array(self._look.skin) * random.uniform(0.98, 1.06)
        scale = head * random.uniform(0.0365, 0.0385)
        return animate_hand(pose, path, middle, CENTRED, scale, side, skin, self._look.clothes)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes contain the hand without the sleeve; the hand is never occluded. The attribute `on the
        face` means that the boxes of hand and face overlap.
        """
        boxes = self.hand.boxes
        middle, head = self._face_position
        low, high = middle - head * FACE / 2, middle + head * FACE / 2
        overlap = np.logical_and(boxes[:, :2] < high, boxes[:, :2] + boxes[:, 2:] > low)
        before = np.asarray(overlap.all(axis=1))
        return SceneTruth(boxes, np.ones(FRAMES), {"on the face": before})

    def render(self, frame: int) -> Image:
        canvas = self._room.copy()
        self._portrait.draw(canvas, self._sway[frame][None], 1 / FINE)
        poses, frames = self._exposed(frame)
        paint(canvas, poses, frames, self._textures, self._lamp * [1, -1, -1, 1])
        return CAMERA.exposed(canvas, self._seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        samples = cover(self.hand.cones[frame], SKIN, *SIZE[::-1])
        return np.asarray(2 * samples >= FINE**2)

    def _exposed(self, frame: int) -> tuple[Array, Array]:
        """Return `moments` and `frames` of `paint` for a frame."""
        around = max(frame - 1, 0), min(frame + 1, FRAMES - 1)
        moments = ((np.arange(FINE) + 0.5) / FINE - 0.5) * EXPOSURE
        interpolated = []
        for values in (self.hand.cones, self.hand.frames):
            rate = (values[around[1]] - values[around[0]]) / (around[1] - around[0])
            interpolated.append(values[frame] + moments[:, None, None] * rate)
        return interpolated[0], interpolated[1]

    @cached_property
    def _room(self) -> Image:
        random = self._random("room")
        return office(random, *SIZE)

    @cached_property
    def _portrait(self) -> Sprite:
        random = self._random("portrait")
        _, head = self._face_position
        return portrait(random, self._look, self._lamp, head, PORTRAIT)

    @cached_property
    def _sway(self) -> Array:
        """Centre of the face in every frame [pixels]; `_face_position` in frame `CENTRED`."""
        random = self._random("sway")
        sway = [random_wander(random, FRAMES, (2.0, 6.0), SWAY) for _ in range(2)]
        middle, _ = self._face_position
        return np.asarray(middle + np.stack(sway, axis=1) - [s[CENTRED] for s in sway])

    @cached_property
    def _textures(self) -> Array:
        random = self._random("textures")
        return hand_textures(random, self._side)

    @cached_property
    def _exposure(self) -> Array:
        random = self._random("exposure")
        return 1.05 * slow_exposure(random, FRAMES, (4.0, 12.0), 0.008)

    @cached_property
    def _side(self) -> int:
        """1 if the hand moves to the right, otherwise -1."""
        return int(self._random("side").choice([-1, 1]))

    @cached_property
    def _face_position(self) -> tuple[Array, float]:
        """Centre of the face, and height of the head [pixels]."""
        random = self._random("place")
        return np.array([80.0, 54.0]) + random.uniform(-4, 4, 2) * [1, 0.75], random.uniform(40, 43)

    @cached_property
    def _look(self) -> FigureLook:
        return sample_person(self._random("look"))

    @cached_property
    def _lamp(self) -> Array:
        """Direction to the window (y up, z away), and the ambient light."""
        random = self._random("lamp")
        lamp = np.array([random.choice([-1, 1]) * random.uniform(0.35, 0.65), 0.6, -0.75])
        return np.append(lamp / np.sqrt((lamp * lamp).sum()), 0.5)
