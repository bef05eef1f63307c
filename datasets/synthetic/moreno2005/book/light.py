"""The light on the book and on the room, and its colour."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.plan import FRAMES
from datasets.synthetic.render.path import smooth_step

__all__ = ["AROUND", "STRAIGHT", "drawn_illuminants", "drawn_lamp"]

Array = NDArray[np.float64]

AROUND, STRAIGHT = 0.28, 1.4
"""Light from all around, and that of the lamp on what faces it."""

NATURAL, YELLOW = np.array([1.12, 1.0, 0.90]), np.array([0.32, 0.84, 1.08])
"""Colours of the light, BGR: as of a window to the north; as of a bulb."""


def drawn_lamp(random: np.random.Generator) -> Array:
    """Direction to the light: aside, a little above, before the book; shape (3,)."""
    lamp = np.array([random.choice([-1, 1]) * random.uniform(0.70, 0.82), -0.35, 0.58])
    return np.asarray(lamp / np.sqrt((lamp * lamp).sum()))


def drawn_illuminants(random: np.random.Generator) -> Array:
    """Colour of the light in every frame as it turns from natural to yellow.

    Returns
    -------
    ndarray of float64, shape (FRAMES, 3)
        Gains of blue, green and red; in the first frame the light is natural.
    """
    start, end = random.uniform(0.02, 0.12), random.uniform(0.88, 0.98)
    share = smooth_step(np.arange(FRAMES) / (FRAMES - 1), start, end)[:, None]
    return np.asarray(NATURAL * (1 - share) + YELLOW * share)
