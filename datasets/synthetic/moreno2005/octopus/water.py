"""What the water above does to the light: it gathers and scatters it, and tints what is seen."""

from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from datasets.interface import Image
from datasets.synthetic.moreno2005.octopus.plan import SIZE
from datasets.synthetic.render.texture import fractal

__all__ = ["Water"]

Floats = NDArray[np.float32]

SIDE = 256
"""After which the pattern repeats [pixels]."""

DRIFT = 0.35, 0.75
"""Of the two layers of waves that make the pattern [pixels/frame]."""

DARKEST, BRIGHTER = 0.94, 0.8
"""Light between the bright lines, and what these add."""

THROUGH = np.array([0.93, 1.0, 0.80], np.float32)
"""What comes through the water, BGR."""

HAZE = np.array([0.34, 0.31, 0.16], np.float32)
"""What it adds where it is all that is seen, BGR."""

THICK = 0.14
"""Part of what is seen that is the water's own."""


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
        x, y = np.mod(drift * frame, SIDE) + 1
        centre = (x + (SIZE[0] - 1) / 2, y + (SIZE[1] - 1) / 2)
        return np.asarray(cv2.getRectSubPix(texture, SIZE, centre), np.float32)

    @cached_property
    def _layers(self) -> list[tuple[Floats, NDArray[np.float64]]]:
        """Textures of lines with a margin, and the drift of each [pixels/frame]."""
        layers = []
        turn = self._random.uniform(0, 2 * np.pi)
        for layer in range(2):
            waves = fractal(self._random, SIDE, 8, 16, 0.5)
            lines = np.clip(1 - 1.15 * np.abs(waves), 0, 1)
            wide = np.tile(lines, (3, 3))[: SIZE[1] + SIDE + 3, : SIZE[0] + SIDE + 3]
            angle = turn + layer * np.pi * self._random.uniform(0.6, 1.4)
            pace = self._random.uniform(*DRIFT)
            layers.append(
                (wide.astype(np.float32), pace * np.array([np.cos(angle), np.sin(angle)]))
            )
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
