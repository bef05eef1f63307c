"""Light between trees: shade on the ground that stays where it is."""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.texture import fractal

__all__ = ["Light", "Shade"]

Light: TypeAlias = Literal["even", "dappled"]

Array = NDArray[np.float64]

PERIOD = 16.0
"""The pattern repeats after this [metres]."""

DEPTH = 0.45
"""Light that full shade takes."""

SLANT_X, SLANT_Z = 0.45, 0.3
"""How far a shadow falls from what casts it, over its height."""

_SIZE = 512


class Shade:
    """Light at every place of the ground and above it.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws the crowns that give shade.
    light : {'even', 'dappled'}
        Even light is 1 everywhere.
    """

    def __init__(self, random: np.random.Generator, light: Light) -> None:
        self.light = light
        # Crowns and gaps of about 3 m: some of both wherever one looks.
        crowns = fractal(random, _SIZE, 8, 32)
        crowns -= np.median(crowns)
        leaves = fractal(random, _SIZE, 32, 128, 0.8)
        cover = np.clip((crowns + 0.30 * leaves - 0.22) * 3.2 + 0.5, 0, 1)
        holes = np.clip((leaves - 0.75) * 4, 0, 1)
        self._gain = 1 - DEPTH * cover * (1 - 0.7 * holes)

    def at(self, x: ArrayLike, z: ArrayLike) -> Array:
        """Light on the ground at places [metres], in [1 - DEPTH, 1]."""
        across, deep = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))
        if self.light == "even":
            return np.ones(across.shape)
        rows = np.floor(deep * (_SIZE / PERIOD)).astype(np.int64) % _SIZE
        place = across * (_SIZE / PERIOD)
        left = np.floor(place).astype(np.int64)
        share = place - left
        line = self._gain
        here, there = line[rows, left % _SIZE], line[rows, (left + 1) % _SIZE]
        return np.asarray(here * (1 - share) + there * share)

    def on_upright(self, x: float, z: float, heights: ArrayLike) -> Array:
        """Light at heights [metres] above a place: where the ray through them meets the ground."""
        up = np.asarray(heights, np.float64)
        return self.at(x + SLANT_X * up, z + SLANT_Z * up)
