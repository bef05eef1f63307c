"""All that a scene is made of, whatever the sun does."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.leaf.blade import Blade, Shape, drawn_blade, placed
from datasets.synthetic.moreno2005.leaf.light import SKY, SUN, Dapples, drawn_sun, fallen
from datasets.synthetic.moreno2005.leaf.thicket import Layer, drawn_layer
from datasets.synthetic.moreno2005.leaf.wind import SIZE, drawn_shapes, drawn_sway
from datasets.synthetic.render.colours import any_of
from datasets.synthetic.render.triangles import Seen, seen
from datasets.synthetic.scene import part_generator

__all__ = ["Setting"]

Array = NDArray[np.float64]

COLOURS = ((52, 156, 148), (60, 132, 166), (58, 168, 124), (70, 118, 150))
"""Of the leaf: yellower than the foliage, or turning brown; BGR."""

FAR, NEAR = 190, 60
"""Leaves that are still, and those before them that sway."""

OPEN = 0.45
"""Least part of the sun that the leaf gets: little is above it."""


class Setting:
    """What the variants of a scene have in common.

    Parameters
    ----------
    seed : int
        Of all that is drawn at random.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.sun = drawn_sun(self._random("sun"))
        self.sunny = bool(self._random("weather").random() < 0.5)

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The leaf in every frame."""
        return drawn_shapes(self._random("wind"))

    @cached_property
    def sway(self) -> Array:
        """See `wind.drawn_sway`."""
        return drawn_sway(self._random("sway"))

    def points(self, frame: int) -> tuple[Array, Array]:
        """The leaf's vertices in a frame, and its directions there; see `blade.placed`."""
        return placed(self._blade, self.shapes[frame])

    def seen(self, frame: int, sun: float) -> Seen:
        """What is seen of the leaf in the light of the sky and of a share of the sun's."""
        points, normals = self.points(frame)
        in_sun = OPEN + (1 - OPEN) * self._dapples.at(points)
        around, straight = fallen(normals, self.sun, in_sun)
        lights = around[:, None] * SKY + straight[:, None] * (sun * SUN)
        return seen(self._blade.mesh, points, lights, SIZE)

    @cached_property
    def layers(self) -> tuple[Layer, Layer]:
        """Foliage that is still, and that which sways before it."""
        return self._layer("still foliage", FAR, 1.0), self._layer("foliage that sways", NEAR, 0.4)

    def _layer(self, part: str, count: int, depth: float) -> Layer:
        random = self._random(part)
        return drawn_layer(random, count, depth, self._colour, self.sun, self._dapples)

    @cached_property
    def _colour(self) -> Array:
        return any_of(self._random("colour"), COLOURS)

    @cached_property
    def _blade(self) -> Blade:
        random = self._random("leaf")
        return drawn_blade(random, random.uniform(76, 90), self._colour)

    @cached_property
    def _dapples(self) -> Dapples:
        return Dapples(self._random("dapples"))

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/leaf {part}")
