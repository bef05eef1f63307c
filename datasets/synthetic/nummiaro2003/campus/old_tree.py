"""Old trees whose trunks hide what passes behind them."""

import numpy as np

from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.texture import fractal, ramp

__all__ = ["old_tree"]

HEIGHT = 5.2
"""To where it is painted: beyond the upper border of the picture [metres]."""

LEAVES = 3.1
"""Twigs hang down to about this height [metres]."""

SPREAD = 2.1
"""How far the twigs reach to either side of the trunk [metres]."""

LEAF = 110
"""Of the texture [pixels/metre]."""

BARK = np.array([[48, 60, 68], [74, 90, 98], [104, 122, 128], [138, 154, 156]], np.float64)
GREENS = np.array([[22, 46, 34], [36, 82, 60], [56, 118, 92], [92, 156, 138]], np.float64)

_SIDE = 512


def old_tree(
    random: np.random.Generator, x: float, z: float, scale: float, width: float, stems: int
) -> list[Prop]:
    """Trunk of one or more stems grown together, and the twigs that hang before it.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws bark and leaves.
    x, z : float
        Where it stands [metres].
    scale : float
        At its depth [pixels/metre].
    width : float
        Of all stems together, where people pass [pixels].
    stems : int
        Number of stems.
    """
    return [
        _trunk(random, x, z, scale, width, stems),
        _twigs(random, x, z - 0.01, scale, width),
    ]


def _trunk(
    random: np.random.Generator, x: float, z: float, scale: float, width: float, stems: int
) -> Prop:
    rows, columns = round(HEIGHT * scale), round(1.5 * width)
    y, right = np.indices((rows, columns)) + 0.5
    up = (rows - y) / scale
    # It widens to the roots, and little by little towards the crown.
    half = width / 2 * (1 + 0.35 * np.exp(-up / 0.11) + 0.05 * np.clip(up - 2, 0, 3))
    across = (right - columns / 2) / half
    cover = np.clip((1 - np.abs(across)) * half + 0.5, 0, 1)
    stem = 2 * ((across + 1) / 2 * stems % 1) - 1
    light = (0.62 + 0.42 * np.sqrt(np.clip(1 - stem * stem, 0, 1))) * (1 - 0.16 * across)
    bark = fractal(random, _SIDE, 8, 256, 0.8)
    tall, wide = (np.floor(v).astype(np.int64) % _SIDE for v in (y * 0.9, right * 2.2))
    colour = ramp(bark[tall, wide], BARK) * np.clip(light, 0.2, 1.1)[..., None]
    return Prop(x, z, colour, cover, rows)


def _twigs(random: np.random.Generator, x: float, z: float, scale: float, width: float) -> Prop:
    low = LEAVES - 0.5
    rows, columns = round((HEIGHT - low) * scale), round(width + 2 * SPREAD * scale)
    y, right = np.indices((rows, columns)) + 0.5
    up = HEIGHT - y / scale
    crown, grain = fractal(random, _SIDE, 4, 64, 0.7), fractal(random, _SIDE, 64, 256, 0.95)
    place = tuple(np.floor(v * (LEAF / scale)).astype(np.int64) % _SIDE for v in (y, right))
    thin = np.abs(2 * right / columns - 1) ** 3
    dense = (up - LEAVES) * 2.2 - 0.6 - 4 * thin + 0.55 * crown[place] + 0.45 * grain[place]
    tone = ramp(0.7 * grain[place] + 0.35 * crown[place], GREENS)
    return Prop(x, z, tone, np.clip(dense * 6, 0, 1), HEIGHT * scale)
