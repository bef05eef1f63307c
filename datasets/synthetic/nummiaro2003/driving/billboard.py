"""Trees, bushes and posts of the street, drawn at any distance."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.lighting import Lighting
from datasets.synthetic.nummiaro2003.driving.thing import NEAREST, Window
from datasets.synthetic.nummiaro2003.driving.view import View
from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.sprite import Sprite
from datasets.synthetic.render.views import Camera

__all__ = ["Cutout", "Standing", "cut_out"]

METRE = 40.0
"""Pixels a metre of the pictures."""


@dataclass(frozen=True)
class Cutout:
    """Picture of a thing without what is behind it.

    Attributes
    ----------
    sprite : Sprite
    foot : float
        Row at which it stands [pixels].
    """

    sprite: Sprite
    foot: float


@dataclass(frozen=True)
class Standing:
    """A thing that stands upright at a place and faces the camera; a `Thing`.

    Attributes
    ----------
    cutout : Cutout
    x, z : float
        [metres].
    size : float
        Against that of its picture.
    """

    cutout: Cutout
    x: float
    z: float
    size: float = 1.0

    @property
    def reach(self) -> float:
        """See `Thing.reach`."""
        return float(self.cutout.sprite.width / 2 * self.size / METRE)

    def window(self, view: View) -> Window | None:
        """See `Thing.window`."""
        column, row, depth = view.place_of(self.x, self.z)
        if depth < NEAREST:
            return None
        scale = view.focal / depth * self.size / METRE
        half, top = self.cutout.sprite.width / 2 * scale, row - self.cutout.foot * scale
        return (
            math.floor(column - half) - 1,
            math.floor(top) - 1,
            math.ceil(column + half) + 1,
            math.ceil(top + self.cutout.sprite.height * scale) + 1,
        )

    def draw(self, canvas: NDArray[np.uint8], view: View, lighting: Lighting) -> None:
        """See `Thing.draw`."""
        column, row, depth = view.place_of(self.x, self.z)
        if depth >= NEAREST:
            scale = view.focal / depth * self.size / METRE
            rise = (self.cutout.foot - self.cutout.sprite.height / 2) * scale
            self.cutout.sprite.draw(canvas, np.array([[column, row - rise]]), scale)


def cut_out(
    make: Callable[[np.random.Generator, float, float, float], Prop], random: np.random.Generator
) -> Cutout:
    """Thing of the street, painted once: seen where a metre has METRE pixels."""
    prop = make(random, 0.0, 1.0, METRE)
    _, top, alpha = prop.coverage(Camera(METRE, 0.0, 0.0, 0.0))
    height, width = alpha.shape
    black = np.zeros((height, width, 3), np.uint8)
    prop.draw(black, Camera(METRE, 0.0, horizon=-top, centre=width / 2))
    cover = alpha / 255
    colour = black / np.maximum(cover, 1 / 255)[..., None]
    return Cutout(Sprite(colour, cover), float(-top))
