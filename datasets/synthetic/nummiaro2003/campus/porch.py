"""Entrances of buildings: people come out of the dark behind an opening."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.texture import fractal

__all__ = ["OPENING", "WALL", "porch"]

Array = NDArray[np.float64]

OPENING = 1.7, 2.35
"""Width and height [metres]."""

WALL = 1.0
"""Width of the walls on both sides of the opening [metres]."""

HEIGHT = 3.0
"""With the roof [metres]."""

PAINTS = ((150, 158, 160), (92, 104, 148), (196, 204, 208), (120, 128, 132))


def porch(
    random: np.random.Generator, x: float, front: tuple[float, float], back: tuple[float, float]
) -> list[Prop]:
    """A porch before a wall: its front with the opening, and what is seen through that.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its material.
    x : float
        Middle of the opening [metres].
    front, back : tuple of float
        Depth [metres] and the scale there [pixels/metre].
    """
    paint = np.array(PAINTS[random.integers(len(PAINTS))]) * random.uniform(0.85, 1.05)
    grain = fractal(random, 256, 16, 128, 0.8)
    return [_front(x, *front, paint, grain), _inside(x, *back, paint)]


def _front(x: float, z: float, scale: float, paint: Array, grain: Array) -> Prop:
    across, up = _raster(OPENING[0] + 2 * WALL, HEIGHT, scale)
    outside = np.maximum(np.abs(across) - OPENING[0] / 2, up - OPENING[1])
    cover = np.clip(outside * scale + 0.5, 0, 1)
    tone = 1 + 0.07 * grain[: len(up), : across.shape[1]]
    tone = tone * np.where(up > HEIGHT - 0.3, 0.62, 1) * np.where(outside < 0.09, 0.6, 1)
    tone = tone * np.where((up > HEIGHT - 0.42) & (up <= HEIGHT - 0.3), 0.75, 1)
    return Prop(x, z, paint * tone[..., None], cover, len(up))


def _inside(x: float, z: float, scale: float, paint: Array) -> Prop:
    """Glass doors at the back of the porch, in its shade."""
    across, up = _raster(OPENING[0] + 2 * WALL, HEIGHT, scale)
    glass = np.array([66.0, 62.0, 56.0]) * (0.55 + 0.16 * np.clip(up, 0, 2.4))[..., None]
    frame = (np.abs(np.abs(across) - 0.42) > 0.37) | (np.abs(up - 1.05) < 0.04) | (up > 2.3)
    colour = np.where(frame[..., None], paint * 0.34, glass)
    return Prop(x, z, colour, np.ones(up.shape), len(up))


def _raster(width: float, height: float, scale: float) -> tuple[Array, Array]:
    """Places to the right of the middle, and above the ground, of every pixel [metres]."""
    rows, columns = round(height * scale), round(width * scale)
    y, x = np.indices((rows, columns)) + 0.5
    return (x - columns / 2) / scale, (rows - y) / scale
