"""Foliage: leaves over leaves, the deeper the darker, some of nearly the target's colour."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.leaf.blade import Blade, Shape, drawn_blade, placed
from datasets.synthetic.moreno2005.leaf.light import SKY, SUN, Dapples, fallen
from datasets.synthetic.moreno2005.leaf.wind import SIZE
from datasets.synthetic.render.colours import any_of, varied
from datasets.synthetic.render.soft_shadow import light_left
from datasets.synthetic.render.triangles import lay, seen

__all__ = ["GREENS", "MARGIN", "Layer", "drawn_layer"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

GREENS = (
    (44, 104, 62), (40, 88, 48), (56, 128, 84), (46, 118, 96), (38, 78, 50), (66, 138, 108),
    (62, 110, 66), (34, 96, 74),
)  # fmt: skip

MARGIN = 8
"""What a layer reaches beyond the picture on every side [pixels]."""

KINDS, ALIKE = 50, 0.2
"""Leaves that grow in a layer, again and again, and the part of them whose colour is near the
target's."""

GROUND = np.array([0.006, 0.010, 0.008])
"""What is behind all leaves."""

OFF, SOFTNESS = 9.0, 3.5
"""How far from a leaf its shadow lies, and how soft it is [pixels]."""

SHADED = 0.35, 0.8
"""Part of the light from all around, and of the sun's, that a leaf takes from those below."""


@dataclass(frozen=True)
class Layer:
    """Leaves, in light of 1 from all around and in light of 1 of the sun.

    Attributes
    ----------
    around, straight : ndarray of float32, shape (height + 2 * MARGIN, width + 2 * MARGIN, 4)
        Light that comes back, premultiplied by the last channel, coverage.
    """

    around: Floats
    straight: Floats

    def lit(self, share: float) -> Floats:
        """It in the light of the sky and in a share of the sun's."""
        sky, sun = np.append(SKY, 1), np.append(share * SUN, 0)
        return np.asarray(self.around * sky + self.straight * sun, np.float32)


def drawn_layer(
    random: np.random.Generator,
    count: int,
    depth: float,
    target: Array,
    sun: Array,
    dapples: Dapples,
) -> Layer:
    """Leaves, drawn at random.

    Parameters
    ----------
    random : numpy.random.Generator
    count : int
        Of the leaves.
    depth : float
        How deep in the foliage they are, in [0, 1]; 1 also closes what is behind them.
    target : ndarray of float64, shape (3,)
        BGR of the target.
    sun : ndarray of float64, shape (3,)
        Direction to the sun.
    dapples : Dapples
        Shade on all that is in the picture.
    """
    size = SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN
    around, straight = (np.zeros((*size[::-1], 4), np.float32) for _ in range(2))
    if depth == 1:
        around[..., :3], around[..., 3], straight[..., 3] = GROUND, 1, 1
    blades = [_blade(random, target) for _ in range(KINDS)]
    for number in range(count):
        higher = 1 - depth * (1 - number / count)
        blade = blades[int(random.integers(KINDS))]
        points, normals = placed(blade, _shape(random, size))
        out_of_picture = points - [MARGIN, MARGIN, 0]
        sky, direct = fallen(normals, sun, dapples.at(out_of_picture) * (0.1 + 0.9 * higher))
        lights = sky * (0.25 + 0.75 * higher), direct
        leaves = [
            seen(blade.mesh, points, np.repeat(light[:, None], 3, axis=1), size) for light in lights
        ]
        coverage = np.zeros(size[::-1], np.float32)
        coverage[leaves[0].window] = leaves[0].sheet[..., 3]
        for sheet, leaf, darkness in zip((around, straight), leaves, SHADED, strict=True):
            sheet[..., :3] *= light_left(coverage, -OFF * sun[:2], SOFTNESS, darkness)
            lay(sheet[leaf.window], leaf.sheet)
    return Layer(around, straight)


def _blade(random: np.random.Generator, target: Array) -> Blade:
    colour = any_of(random, GREENS)
    if random.random() < ALIKE:
        share = random.uniform(0.5, 0.9)
        colour = (1 - share) * colour + share * varied(random, target)
    return drawn_blade(random, random.uniform(40, 76), colour)


def _shape(random: np.random.Generator, size: tuple[int, int]) -> Shape:
    return Shape(
        random.uniform(-10, 10, 2) + random.uniform(0, 1, 2) * size,
        random.uniform(-np.pi, np.pi),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.3, 1.0),
        random.uniform(0.1, 0.5),
    )
