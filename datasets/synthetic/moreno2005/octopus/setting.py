"""The sea floor, stones that lie on it, algae that grow there; and the water above.

The water gathers and scatters the light, and tints what is seen.
"""

from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Image
from trackmark.datasets.synthetic.moreno2005.octopus.looks import SIDE
from trackmark.datasets.synthetic.moreno2005.octopus.plan import SIZE, Zones
from trackmark.datasets.synthetic.moreno2005.octopus.relief import lit, moulded, shade
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FINE = 2  # samples per pixel and axis
STONES, TUFTS = 34, 26  # how many lie and grow there
STONE = 2.5, 11.0  # radius of a stone; the smaller, the more of them [pixels]
BLADES = 10, 26  # of a tuft of algae
BLADE = 7.0, 17.0  # length of one [pixels]
# Their colours, RGB in [0, 1].
ALGAE = np.array([[0.30, 0.42, 0.14], [0.44, 0.30, 0.12], [0.50, 0.14, 0.20], [0.62, 0.58, 0.26]])
REPEAT = 256  # after which the pattern repeats [pixels]
DRIFT = 0.35, 0.75  # of the two layers of waves that make the pattern [pixels/frame]
DARKEST, BRIGHTER = 0.94, 0.8  # light between the bright lines, and what these add
THROUGH = np.array([0.93, 1.0, 0.80], np.float32)  # what comes through the water, BGR
HAZE = np.array([0.34, 0.31, 0.16], np.float32)  # what it adds where it is all that is seen, BGR
THICK = 0.14  # part of what is seen that is the water's own


def painted_floor(seed: int, zones: Zones, textures: Sequence[Array]) -> Floats:
    """Picture of the floor in even light, BGR in [0, 1], shape (height, width, 3).

    The textures are those of the floors, shape (SIDE, SIDE, 3).
    """
    random = part_generator(seed, "moreno2005/octopus things")
    rows, columns = (np.indices(SIZE[::-1]) + 0.5).astype(np.float64)
    uneven = 9 * fractal(random, SIDE, 32, 128)[: SIZE[1], : SIZE[0], None]
    shares = zones.shares(np.stack([columns, rows], axis=2) + uneven)
    ground = np.zeros((*SIZE[::-1], 3))
    for floor, texture in enumerate(textures):
        ground += shares[..., floor : floor + 1] * texture[: SIZE[1], : SIZE[0]]
    large = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_CUBIC)
    canvas = np.asarray(large, np.float32)
    grain = fractal(random, SIDE, 64, 256, 0.8)
    places = random.uniform((0, 0), SIZE, (STONES + TUFTS, 2))
    for number, place in enumerate(places):
        if number < STONES:
            _lay_stone(random, canvas, grain, place)
        else:
            _plant_tuft(random, canvas, place)
    reduced = cv2.resize(canvas, SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(np.clip(reduced, 0, 1), np.float32)


def _lay_stone(random: np.random.Generator, canvas: Floats, grain: Array, place: Array) -> None:
    """Some balls together, flat and rough; the canvas is changed in place."""
    radius = STONE[0] + (STONE[1] - STONE[0]) * random.random() ** 2
    count = int(random.integers(3, 7))
    middles = place + random.uniform(-0.7, 0.7, (count, 2)) * radius
    radii = radius * random.uniform(0.5, 1.0, (count, 1))
    balls = np.hstack([middles, radii, np.zeros((count, 1)), np.full((count, 1), 0.6)])
    window, corner = _window(canvas, place, 3 * radius)
    height, owner = moulded(balls, corner, 1 / FINE, window.shape[:2])
    covered = owner >= 0
    fall = 1 + round(0.25 * radius * FINE), 1 + round(0.35 * radius * FINE)
    shade(window, covered.astype(np.float32), fall, 0.25 * radius * FINE + 0.5, 0.5)
    column, row = random.integers(SIDE // 2, size=2)
    rough = grain[row:, column:][: window.shape[0], : window.shape[1], None]
    tone = random.uniform(0.22, 0.62) * random.uniform(0.85, 1.1, 3)
    colour = tone * (1 + 0.16 * rough) * lit(height * FINE, 1.5)[..., None]
    window[covered] = colour[covered]


def _plant_tuft(random: np.random.Generator, canvas: Floats, place: Array) -> None:
    """Bent blades from one place; the canvas is changed in place."""
    window, corner = _window(canvas, place, 1.5 * BLADE[1])
    colour = ALGAE[random.integers(len(ALGAE)), ::-1] * random.uniform(0.8, 1.15)
    lean = random.uniform(0, 2 * np.pi)
    blades = []
    for _ in range(int(random.integers(*BLADES))):
        along = np.linspace(0, 1, 8)[:, None]
        direction = lean + random.normal(0, 0.9) + random.normal(0, 0.8) * along
        steps = np.hstack([np.cos(direction), np.sin(direction)]) * random.uniform(*BLADE) / 8
        points = place - corner + random.normal(0, 2.0, 2) + np.cumsum(steps, axis=0)
        blades.append(np.round(points * FINE * 16).astype(np.int32))
    shadow = np.zeros(window.shape[:2], np.float32)
    for blade in blades:
        cv2.polylines(shadow, [blade], False, 1.0, 3, cv2.LINE_8, 4)
    shade(window, shadow, (3, 4), 2.0, 0.4)
    drawn = window.copy()  # OpenCV draws on arrays of their own only
    for blade in blades:
        tone = (colour * random.uniform(0.6, 1.35)).tolist()
        cv2.polylines(drawn, [blade], False, tone, int(random.integers(1, 4)), cv2.LINE_8, 4)
    window[:] = drawn


def _window(canvas: Floats, place: Array, reach: float) -> tuple[Floats, tuple[float, float]]:
    """Part of a canvas around a place, and its left top corner; all lengths in pixels."""
    left, top = np.maximum(np.floor((place - reach) * FINE), 0).astype(int).tolist()
    right, bottom = np.ceil((place + reach) * FINE).astype(int).tolist()
    return canvas[top:bottom, left:right], (left / FINE, top / FINE)


class Water:
    """Slow caustics and haze."""

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random

    def over(self, picture: Floats, frame: int) -> Image:
        """A picture in even light, BGR in [0, 1], as it is seen through the water."""
        canvas = np.empty(picture.shape, np.uint8)
        first, second = (self._layer(layer, frame) for layer in range(2))
        _look_through(picture, first, second, THROUGH * (1 - THICK), HAZE * THICK, canvas)
        return canvas

    def _layer(self, layer: int, frame: int) -> Floats:
        texture, drift = self._layers[layer]
        x, y = np.mod(drift * frame, REPEAT) + 1
        centre = (x + (SIZE[0] - 1) / 2, y + (SIZE[1] - 1) / 2)
        return np.asarray(cv2.getRectSubPix(texture, SIZE, centre), np.float32)

    @cached_property
    def _layers(self) -> list[tuple[Floats, Array]]:
        """Textures of lines with a margin, and the drift of each [pixels/frame]."""
        layers = []
        turn = self._random.uniform(0, 2 * np.pi)
        for layer in range(2):
            waves = fractal(self._random, REPEAT, 8, 16, 0.5)
            lines = np.clip(1 - 1.15 * np.abs(waves), 0, 1)
            wide = np.tile(lines, (3, 3))[: SIZE[1] + REPEAT + 3, : SIZE[0] + REPEAT + 3]
            angle = turn + layer * np.pi * self._random.uniform(0.6, 1.4)
            pace = self._random.uniform(*DRIFT)
            drift = pace * np.array([np.cos(angle), np.sin(angle)])
            layers.append((wide.astype(np.float32), drift))
        return layers


@njit(cache=True)
def _look_through(
    picture: Floats, first: Floats, second: Floats, through: Floats, haze: Floats, out: Image
) -> None:
    """Light a picture where both layers have a bright line, tint it, and count grey levels."""
    rows, columns = first.shape
    for i in range(rows):
        for j in range(columns):
            line = min(first[i, j], second[i, j])
            gain = np.float32(DARKEST) + np.float32(BRIGHTER) * line * line * line
            for k in range(3):
                value = picture[i, j, k] * gain * through[k] + haze[k]
                out[i, j, k] = int(min(max(value, np.float32(0)), np.float32(1)) * 255 + 0.5)
