"""Old trees whose trunks hide what passes behind them."""

import numpy as np

from datasets.synthetic.engine.texture import fractal, lerp, ramp
from datasets.synthetic.street.prop import Prop

__all__ = ["trunk"]

HEIGHT = 5.2
"""To where it is painted: beyond the upper border of the picture [metres]."""

LEAVES = 3.1
"""Twigs hang down to about this height [metres]."""

SPREAD = 2.1
"""How far the twigs reach to either side of the trunk [metres]."""

BARK = np.array([[48, 60, 68], [74, 90, 98], [104, 122, 128], [138, 154, 156]], np.float64)
GREENS = np.array([[22, 46, 34], [36, 82, 60], [56, 118, 92], [92, 156, 138]], np.float64)

_SIDE = 512


def trunk(
    random: np.random.Generator, x: float, z: float, scale: float, width: float, stems: int
) -> Prop:
    """Trunk of one or more stems grown together, under hanging twigs.

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
    rows, columns = round(HEIGHT * scale), round(width + 2 * SPREAD * scale)
    y, x_ = np.indices((rows, columns)) + 0.5
    up = (rows - y) / scale
    # It widens to the roots, and little by little towards the crown.
    half = width / 2 * (1 + 0.35 * np.exp(-up / 0.11) + 0.05 * np.clip(up - 2, 0, 3))
    across = (x_ - columns / 2) / half
    cover = np.clip((1 - np.abs(across)) * half + 0.5, 0, 1)
    stem = 2 * ((across + 1) / 2 * stems % 1) - 1
    light = (0.62 + 0.42 * np.sqrt(np.clip(1 - stem * stem, 0, 1))) * (1 - 0.16 * across)
    bark = fractal(random, _SIDE, 8, 256, 0.8)
    tall, wide = (np.floor(v).astype(np.int64) % _SIDE for v in (y * 0.9, x_ * 2.2))
    colour = ramp(bark[tall, wide], BARK) * np.clip(light, 0.2, 1.1)[..., None]
    crown, grain = fractal(random, _SIDE, 4, 64, 0.7), fractal(random, _SIDE, 64, 256, 0.95)
    place = tuple(np.floor(v * (110 / scale)).astype(np.int64) % _SIDE for v in (y, x_))
    thin = np.abs(2 * x_ / columns - 1) ** 3
    dense = (up - LEAVES) * 2.2 - 0.6 - 4 * thin + 0.55 * crown[place] + 0.45 * grain[place]
    leaves = np.clip(dense * 6, 0, 1)
    tone = ramp(0.7 * grain[place] + 0.35 * crown[place], GREENS)
    return Prop(x, z, lerp(colour, tone, leaves), 1 - (1 - cover) * (1 - leaves), rows)
