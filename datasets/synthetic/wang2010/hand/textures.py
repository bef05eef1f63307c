"""The lines of a palm, and the folds of a sleeve."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.texture import fractal

__all__ = ["SIDE", "TEXELS", "WRIST_ROW", "textures"]

Array = NDArray[np.float64]

SIDE = 256
"""Rows and columns of a texture."""

TEXELS = 10.0
"""A centimetre."""

WRIST_ROW = 226
"""The wrist lies in the middle of this row."""


def textures(random: np.random.Generator, side: int) -> Array:
    """Gain of light on skin and on cloth, shape (2, SIDE, SIDE); see `cones.paint`.

    Parameters
    ----------
    random : numpy.random.Generator
    side : {-1, 1}
        1 for a right hand.
    """
    y, x = np.indices((SIDE, SIDE))
    right, up = (x + 0.5 - SIDE / 2) / TEXELS * side, (WRIST_ROW - y) / TEXELS
    shift = random.uniform(-0.25, 0.25, 3)
    around = np.hypot(right - 4.3, up - 2.6)  # of the thumb's ball
    life = _line(around - 3.9 - shift[0], 0.22) * (up > 1.2) * (up < 6.6) * (right < 3.4)
    heart = _line(up - 7.6 - shift[1] + 0.09 * np.square(right - 1.6), 0.20)
    heart = heart * (right > -3.6) * (right < 1.6)
    head = _line(up - 5.9 - shift[2] + 0.07 * np.square(right - 2.6), 0.18)
    head = head * (right > -2.4) * (right < 2.8)
    wrist = _line(up - 0.1 - 0.03 * np.square(right), 0.16) * (np.abs(right) < 2.4)
    skin = 1 + 0.035 * fractal(random, SIDE, 8, 64, 0.8)
    skin = skin * (1 - 0.17 * np.clip(life + heart + 0.8 * head + wrist, 0, 1))
    folds = fractal(random, SIDE, 8, 32, 0.7)
    cloth = 1 + 0.05 * fractal(random, SIDE, 4, 16) + 0.30 * (folds - np.roll(folds, 3, axis=0))
    return np.stack([skin, cloth + random.normal(0, 0.03, cloth.shape)])


def _line(distance: Array, width: float) -> Array:
    return np.asarray(1 / (1 + np.square(np.square(distance / width))))
