"""A ball of orange celluloid."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.sprite import Sprite, superellipse

__all__ = ["FINE", "ball"]

Array = NDArray[np.float64]

FINE = 8
"""Painted pixels per pixel of the picture."""


def ball(random: np.random.Generator, lamp: Array, diameter: float) -> Sprite:
    """Paint it.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its tone.
    lamp : ndarray of float64, shape (3,)
        Direction to the light: right, down, to the camera.
    diameter : float
        [pixels].
    """
    paint = np.array([random.uniform(36, 56), random.uniform(138, 154), 240.0])
    side = 2 * int(np.ceil(diameter * FINE / 2)) + 2
    radius = diameter * FINE / 2
    right, down, coverage = superellipse(side, side, radius, radius, 2)
    forward = np.sqrt(np.clip(1 - right * right - down * down, 0, 1))
    facing = right * lamp[0] + down * lamp[1] + forward * lamp[2]
    light = 0.50 + 0.62 * np.clip(0.15 + 0.85 * facing, 0, 1)
    # Half way between the lamp and the camera the celluloid shines.
    half = (lamp + (0, 0, 1)) / np.sqrt(2 + 2 * lamp[2])
    shine = np.clip(right * half[0] + down * half[1] + forward * half[2], 0, 1)
    for _ in range(5):
        shine = shine * shine
    return Sprite(paint * light[..., None] + 120 * shine[..., None], coverage)
