"""The ground: roads, their markings, pavements and lawns as level rectangles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.facets import Facets, Pictures, packed
from datasets.synthetic.nummiaro2003.driving.solid import assembled, flat
from datasets.synthetic.render.texture import fractal, grass, paving

__all__ = ["ASPHALT", "GRASS", "KERB", "PAINT", "PAVING", "Strip", "dashes", "laid", "surfaces"]

Array = NDArray[np.float64]

ASPHALT, PAVING, GRASS, KERB, PAINT = range(5)
"""What the ground is made of."""

_DENSITIES = (96.0, 128.0, 64.0, 64.0, 64.0)
"""Pixels a metre."""

_SIZE = 512


@dataclass(frozen=True)
class Strip:
    """A rectangle along the axes.

    Attributes
    ----------
    kind : int
        What it is made of.
    x, z : tuple of float
        From and to [metres].
    """

    kind: int
    x: tuple[float, float]
    z: tuple[float, float]


def laid(strips: Sequence[Strip]) -> Facets:
    """Facets of strips; where two overlap, the one that comes first is seen."""
    densities = np.array(_DENSITIES)
    projections = np.zeros((len(_DENSITIES), 2, 4))
    projections[:, 0, 0] = projections[:, 1, 2] = densities
    return assembled([flat(0.0, strip.x, strip.z, strip.kind) for strip in strips], projections)


def dashes(
    start: float, end: float, across: float, along_x: bool, line: float = 3.0, gap: float = 6.0
) -> list[Strip]:
    """Broken line along an axis; all in metres."""
    width = (across - 0.06, across + 0.06)
    return [
        Strip(PAINT, (s, s + line), width) if along_x else Strip(PAINT, width, (s, s + line))
        for s in np.arange(start, end, line + gap).tolist()
    ]


def surfaces(random: np.random.Generator) -> Pictures:
    """Pictures of all that the ground is made of."""
    grain = fractal(random, _SIZE, 32, _SIZE // 2, 0.95)
    blots = fractal(random, _SIZE, 4, 16)
    tone = 1 + 0.11 * grain + 0.035 * blots
    asphalt = np.array([104.0, 104.0, 106.0]) * random.uniform(0.88, 1.12) * tone[..., None]
    worn = 1 - 0.3 * np.clip(fractal(random, _SIZE, 16, 256, 0.8) - 0.7, 0, 1)
    stone = 1 + 0.06 * grain
    kerb = 150.0 * stone[..., None] * np.ones(3)
    kerb[:, :: _SIZE // 8] *= 0.7
    kerb[:: _SIZE // 8] *= 0.7
    slabs = paving(random, _SIZE)
    slabs = slabs.mean() * 1.05 + 0.6 * (slabs - slabs.mean())
    lawn = grass(random, _SIZE)
    return packed([asphalt, slabs, lawn, kerb, 214.0 * (worn * (1 + 0.04 * grain))[..., None]
                   * np.ones(3)])  # fmt: skip
