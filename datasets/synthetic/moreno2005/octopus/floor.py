"""The sea floor: its zones, stones that lie on it, algae that grow there."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.octopus.looks import SIDE
from datasets.synthetic.moreno2005.octopus.moulding import mould
from datasets.synthetic.moreno2005.octopus.plan import SIZE
from datasets.synthetic.moreno2005.octopus.relief import lit, shade
from datasets.synthetic.moreno2005.octopus.zones import Zones
from datasets.synthetic.render.texture import fractal
from datasets.synthetic.scene import part_generator

__all__ = ["painted_floor"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FINE = 2
"""Samples per pixel and axis."""

STONES, TUFTS = 34, 26

STONE = 2.5, 11.0
"""Radius of a stone; the smaller, the more of them [pixels]."""

BLADES = 10, 26
"""Of a tuft of algae."""

BLADE = 7.0, 17.0
"""Length of one [pixels]."""

ALGAE = np.array([[0.30, 0.42, 0.14], [0.44, 0.30, 0.12], [0.50, 0.14, 0.20], [0.62, 0.58, 0.26]])
"""Their colours, RGB in [0, 1]."""


def painted_floor(seed: int, zones: Zones, textures: Sequence[Array]) -> Floats:
    """Picture of the floor in even light, BGR in [0, 1], shape (height, width, 3).

    Parameters
    ----------
    seed : int
        Of the scene.
    zones : Zones
        Which floor is where.
    textures : sequence of ndarray of float64, shape (SIDE, SIDE, 3)
        Of the floors.
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
    height = np.zeros(window.shape[:2], np.float32)
    owner = np.full(window.shape[:2], -1, np.int32)
    mould(balls, *corner, 1 / FINE, height, owner)
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
