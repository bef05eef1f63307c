"""Far side of a street: a row of different houses below a sky."""

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.texture import fractal

Picture = NDArray[np.uint8]
Box = tuple[float, float, float, float]  # left, top, right and bottom of a rectangle

WALLS = (
    (72, 84, 150),  # brick
    (60, 66, 116),  # dark brick
    (168, 196, 214),  # cream
    (196, 204, 208),  # light grey
    (132, 170, 198),  # ochre
    (150, 158, 160),  # concrete
    (120, 136, 176),  # salmon
    (170, 178, 150),  # pale green
    (206, 196, 178),  # pale blue
    (104, 126, 146),  # sandstone
    (212, 220, 226),  # white
)
SIGNS = ((40, 44, 150), (120, 70, 30), (50, 110, 50), (30, 30, 34), (40, 150, 200), (90, 40, 90))
ROOFS = ((60, 68, 96), (70, 66, 62), (84, 84, 90))

FINE = 2  # supersampling per axis


def backdrop(random: Generator, height: int, width: int, scale: float, base: float) -> Picture:
    """Return an image of adjacent houses and the sky above them, shape (height, width, 3).

    `scale` is in pixels/metre. The houses meet the ground at the row `base`.
    """
    picture = _sky(random, FINE * height, FINE * width, FINE * base)
    metre = FINE * scale
    front = _Front(random, picture, FINE * base, metre)
    x = -random.uniform(0, 8) * metre
    while x < FINE * width:
        if random.random() < 0.1:  # gap between houses: a garden behind a wall
            wide = random.uniform(3, 5) * metre
            front.garden(x, x + wide)
        else:
            wide = random.uniform(5.5, 13) * metre
            front.house(x, x + wide)
        x += wide
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    haze = np.array([188.0, 182.0, 174.0])
    return np.round(small * 0.90 + haze * 0.10).astype(np.uint8)


def _sky(random: Generator, height: int, width: int, base: float) -> Picture:
    clouds = fractal(random, 256, 2, 64, 0.6)
    stretched = cv2.resize(np.tile(clouds, (1, 2)), (width, height), interpolation=cv2.INTER_LINEAR)
    picture: Picture = _clouded(np.asarray(stretched), np.linspace(0, 1, height))
    x = 0
    while x < width:  # distant town
        wide, high = random.integers(30, 120), random.integers(30, 190)
        tone = random.uniform(150, 186) + np.array([10.0, 4.0, -4.0])
        _fill(picture, (x, base - high, x + int(wide), base), tone)
        x += int(wide)
    return picture


@njit(cache=True)
def _clouded(clouds: Array, down: Array) -> Picture:
    """Return a sky; `clouds` is noise, about in [-1, 1], `down` in [0, 1] is the paleness."""
    blue, pale = np.array([214.0, 178.0, 140.0]), np.array([226.0, 220.0, 212.0])
    picture = np.empty((*clouds.shape, 3), np.uint8)
    for row in range(len(clouds)):
        colour = blue + (pale - blue) * min(down[row] * 1.4, 1.0)
        for column in range(clouds.shape[1]):
            cover = min(max(clouds[row, column] * 0.7 + 0.35, 0.0), 1.0)
            for c in range(3):
                light = colour[c] * (1 - cover) + 228.0 * cover
                picture[row, column, c] = np.uint8(min(max(light, 0.0), 255.0))
    return picture


def _fill(picture: Picture, box: Box, colour: Array) -> None:
    left, top, right, bottom = (round(v) for v in box)
    cv2.rectangle(picture, (left, top), (right - 1, bottom - 1), colour.tolist(), -1)


class _Front:
    """Canvas for houses that meet the ground at the row `base`; `metre` is in pixels."""

    def __init__(self, random: Generator, picture: Picture, base: float, metre: float) -> None:
        self._random, self._picture = random, picture
        self._base, self._metre = base, metre
        self._grain = fractal(random, 512, 16, 256, 0.8)

    def _fill(self, box: Box, colour: Array) -> None:
        _fill(self._picture, box, colour)

    def _shade(self, box: Box, gain: Array | float) -> None:
        """Multiply a region by a gain; arrays are cut or repeated to the size of the region."""
        height, width = self._picture.shape[:2]
        left, right = max(round(box[0]), 0), min(round(box[2]), width)
        top, bottom = max(round(box[1]), 0), min(round(box[3]), height)
        if left >= right or top >= bottom:
            return
        region = self._picture[top:bottom, left:right]
        if isinstance(gain, np.ndarray):
            rows = np.arange(top, bottom) % gain.shape[0]
            gain = gain[rows[:, None], np.arange(left, right) % gain.shape[1], None]
        region[:] = np.clip(region * gain, 0, 255).astype(np.uint8)

    def house(self, left: float, right: float) -> None:
        random, metre, base = self._random, self._metre, self._base
        colour = np.array(WALLS[random.integers(len(WALLS))]) * random.uniform(0.82, 1.08)
        floors, storey = int(random.integers(2, 5)), random.uniform(2.8, 3.3) * metre
        ground = random.uniform(3.2, 3.9) * metre
        top = base - ground - floors * storey
        wall = (left, top, right, base)
        self._fill(wall, colour)
        self._shade(wall, 1 + 0.09 * self._grain)
        if colour[2] > 1.25 * colour[0]:  # brick has courses
            courses = 1 - 0.10 * ((np.arange(512) % max(round(0.16 * metre), 3)) == 0)
            self._shade(wall, np.repeat(courses[:, None], 4, axis=1))
        if top > 0:
            self._roof(left, right, top)
        columns = max(1, int((right - left) / (random.uniform(1.7, 2.5) * metre)))
        wide, high = random.uniform(0.85, 1.25) * metre, random.uniform(1.35, 1.85) * metre
        trim = colour * 0.5 + 118 if random.random() < 0.6 else colour * 0.62
        curtains = random.uniform(0.2, 0.7)
        for floor in range(floors):
            sill = base - ground - floor * storey - 0.75 * metre
            for column in range(columns):
                middle = left + (right - left) * (column + 0.5) / columns
                box = (middle - wide / 2, sill - high, middle + wide / 2, sill)
                self._window(box, trim, curtains)
        self._ground_floor((left, base - ground, right, base), colour)
        band = (left, base - ground - 0.12 * metre, right, base - ground)
        self._fill(band, trim)
        self._shade((left, band[3], right, band[3] + 0.15 * metre), 0.7)
        pipe = right - 0.12 * metre
        self._shade((pipe, top, pipe + 0.09 * metre, base), 0.6)
        self._shade((left, top, left + 0.06 * metre, base), 0.75)

    def _roof(self, left: float, right: float, top: float) -> None:
        random, metre = self._random, self._metre
        colour = np.array(ROOFS[random.integers(len(ROOFS))])
        if random.random() < 0.6:
            rise, inset = random.uniform(1.2, 2.4) * metre, random.uniform(0.1, 0.9) * metre
            corners = [(left, top), (left + inset, top - rise), (right - inset, top - rise)]
            shape = np.round([*corners, (right, top)]).astype(np.int32)
            cv2.fillPoly(self._picture, [shape], colour.tolist())
            if random.random() < 0.6:
                x = random.uniform(left + inset, right - inset - 0.6 * metre)
                chimney = (x, top - rise - 0.8 * metre, x + 0.6 * metre, top - rise * 0.4)
                self._fill(chimney, colour * 1.15)
        self._fill((left, top - 0.1 * metre, right, top + 0.15 * metre), colour * 0.4 + 110)
        self._shade((left, top + 0.15 * metre, right, top + 0.4 * metre), 0.72)

    def _window(self, box: Box, trim: Array, curtains: float) -> None:
        random, metre = self._random, self._metre
        left, top, right, bottom = box
        edge = 0.07 * metre
        self._fill((left - edge, top - edge, right + edge, bottom + edge), trim)
        glass = np.array([96.0, 84.0, 74.0]) * random.uniform(0.5, 1.15)
        self._fill(box, glass)
        shine = random.uniform(0.3, 0.9)
        self._fill((left, top, right, top + (bottom - top) * shine * 0.6), glass * 1.35 + 12)
        if random.random() < curtains:
            cloth = np.array([196.0, 202.0, 206.0]) * random.uniform(0.55, 0.95)
            drawn = (right - left) * random.uniform(0.15, 0.45)
            self._fill((left, top, left + drawn, bottom), cloth)
            self._fill((right - drawn, top, right, bottom), cloth * 0.9)
        middle = (left + right) / 2
        bar = 0.03 * metre
        self._fill((middle - bar, top, middle + bar, bottom), trim)
        self._fill(
            (left, top + (bottom - top) * 0.4 - bar, right, top + (bottom - top) * 0.4), trim
        )
        self._shade((left, top, right, top + 0.14 * metre), 0.55)
        self._shade((left, top, left + 0.08 * metre, bottom), 0.7)
        self._fill((left - 0.12 * metre, bottom, right + 0.12 * metre, bottom + edge), trim * 1.1)
        self._shade((left - edge, bottom + edge, right + edge, bottom + 2.2 * edge), 0.72)

    def _ground_floor(self, box: Box, colour: Array) -> None:
        random, metre = self._random, self._metre
        left, top, right, base = box
        if random.random() < 0.45:  # block of flats: a door, windows
            door_x = random.uniform(left + 0.5 * metre, right - 1.6 * metre)
            wood = np.array(SIGNS[random.integers(len(SIGNS))]) * 0.8 + 20
            for middle in np.arange(left + 1.3 * metre, right - metre, 2.3 * metre):
                if abs(middle - door_x - 0.5 * metre) > 1.4 * metre:
                    window = (middle - 0.5 * metre, top + 0.8 * metre, middle + 0.5 * metre,
                              top + 2.3 * metre)  # fmt: skip
                    self._window(window, colour * 0.5 + 110, 0.4)
            self._fill(
                (door_x - 0.12 * metre, base - 2.5 * metre, door_x + 1.12 * metre, base),
                colour * 0.7,
            )
            self._fill((door_x, base - 2.35 * metre, door_x + metre, base), wood)
            self._shade((door_x, base - 2.35 * metre, door_x + 0.1 * metre, base), 0.6)
            self._shade((left, base - 0.5 * metre, right, base), 0.82)
            return
        front = (left + 0.35 * metre, top + 0.75 * metre, right - 0.35 * metre, base - 0.5 * metre)
        frame = np.array(SIGNS[random.integers(len(SIGNS))]) * 0.7 + 30
        self._fill((front[0] - 0.1 * metre, front[1], front[2] + 0.1 * metre, base), frame)
        self._fill(front, np.array([70.0, 62.0, 58.0]) * random.uniform(0.6, 1.2))
        for _ in range(int((right - left) / metre * 5)):  # goods behind the glass
            x = random.uniform(front[0], front[2])
            y = random.uniform(front[1] + 0.5 * metre, front[3])
            size = random.uniform(0.06, 0.3, 2) * metre
            goods = random.uniform(40, 190, 3)
            item = (x, y - size[1], min(x + size[0], front[2]), y)
            self._fill(item, goods * 0.7)
        self._shade((front[0], front[1], front[2], front[1] + 0.5 * metre), 0.6)
        for bar in np.arange(front[0], front[2], 2.1 * metre):
            self._fill((bar, front[1], bar + 0.08 * metre, base), frame)
        sign = np.array(SIGNS[random.integers(len(SIGNS))], np.float64) * random.uniform(0.8, 1.3)
        board = (left + 0.2 * metre, top + 0.1 * metre, right - 0.2 * metre, top + 0.75 * metre)
        self._fill(board, sign)
        ink = np.full(3, 226.0) if sign.mean() < 120 else np.full(3, 40.0)
        x = board[0] + random.uniform(0.3, 1.5) * metre
        while x < board[2] - 0.5 * metre and random.random() < 0.93:  # letters
            wide = random.uniform(0.1, 0.24) * metre
            tall = random.uniform(0.2, 0.32) * metre
            middle = (board[1] + board[3]) / 2
            self._fill((x, middle - tall / 2, x + wide, middle + tall / 2), ink)
            self._fill(
                (x + wide * 0.3, middle - tall * 0.2, x + wide * 0.75, middle + 0.1 * tall), sign
            )
            x += wide * 1.4
        if random.random() < 0.5:
            self._awning(front, top + 0.8 * metre)

    def _awning(self, front: Box, top: float) -> None:
        random, metre = self._random, self._metre
        colour = np.array(SIGNS[random.integers(len(SIGNS))], np.float64) * 1.1 + 10
        other = np.full(3, 214.0) if random.random() < 0.6 else colour * 0.85
        stripe = 0.32 * metre
        for k, x in enumerate(np.arange(front[0], front[2] - stripe / 2, stripe)):
            end = min(x + stripe, front[2])
            shape = [(x, top), (end, top), (end + 0.12 * metre, top + 0.7 * metre),
                     (x + 0.12 * metre, top + 0.7 * metre)]  # fmt: skip
            shade = colour if k % 2 else other
            cv2.fillPoly(self._picture, [np.round(shape).astype(np.int32)], shade.tolist())
        self._shade((front[0], top + 0.7 * metre, front[2], top + 1.2 * metre), 0.6)
        self._shade((front[0], top + 0.55 * metre, front[2], top + 0.7 * metre), 0.82)

    def garden(self, left: float, right: float) -> None:
        random, metre, base = self._random, self._metre, self._base
        for number in range(round((right - left) / metre * 90)):
            x = random.uniform(left, right)
            rise = 4.4 - 1.4 * np.sin(0.9 * x / metre)
            y = base - random.uniform(0.8, rise) * metre
            green = np.array([46.0, 92.0, 70.0]) * random.uniform(0.5, 0.7 + 0.5 * (number % 7) / 7)
            radius = round(random.uniform(0.08, 0.26) * metre)
            cv2.circle(self._picture, (round(x), round(y)), radius, green.tolist(), -1)
        self._shade((left, base - 5 * metre, right, base), 1 + 0.16 * self._grain)
        wall = np.array(WALLS[random.integers(len(WALLS))]) * 0.85
        self._fill((left, base - 1.4 * metre, right, base), wall)
        self._shade((left, base - 1.4 * metre, right, base), 1 + 0.1 * self._grain)
        self._fill((left, base - 1.5 * metre, right, base - 1.4 * metre), wall * 1.15)
