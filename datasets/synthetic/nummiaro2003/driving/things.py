"""Things that stand in a place or drive through it, as a renderer needs them."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.view import View
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.views import Viewpoint

Array = NDArray[np.float64]

Window = tuple[int, int, int, int]
"""Left, top, right and bottom of some pixels, the last two excluded."""

NEAREST = 2.0
"""Things nearer to the camera than this are not drawn [metres]."""


class Thing(Protocol):
    """Something at a place on the ground."""

    @property
    def x(self) -> float:
        """Place of its middle, to the right [metres]."""
        ...

    @property
    def z(self) -> float:
        """Place of its middle, ahead [metres]."""
        ...

    @property
    def reach(self) -> float:
        """No part of it is farther from its middle, over the ground [metres]."""
        ...

    def window(self, view: View) -> Window | None:
        """Pixels that it may be seen in, wherever they lie; None behind the camera."""
        ...

    def draw(self, canvas: NDArray[np.uint8], view: View) -> None:
        """Draw it over a canvas, which is changed in place."""
        ...


def from_far(things: list[Thing], view: View, width: int) -> list[Thing]:
    """Things that may be in a picture of a width [pixels], the farthest first."""
    x, z, reach = np.array([(thing.x, thing.z, thing.reach) for thing in things]).T
    right, _, ahead = view.seen_from(np.stack([x, np.zeros(len(x)), z], axis=1)).T
    # The tangent of half the field of view, and something for the slope of its border.
    edge = width / 2 / view.focal
    seen = (ahead > -reach) & (np.abs(right) < edge * (ahead + reach) + 1.2 * reach)
    apart = right * right + ahead * ahead
    return [things[i] for i in np.argsort(-apart, kind="stable") if seen[i]]


def meet(one: Window, other: Window) -> bool:
    """Whether two windows have pixels in common."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


METRE = 40.0
"""Pixels a metre of the pictures."""


@dataclass(frozen=True)
class Cutout:
    """Picture of a thing without what is behind it."""

    sprite: Sprite
    foot: float  # row at which it stands [pixels]


@dataclass(frozen=True)
class Standing:
    """A thing that stands upright at a place and faces the camera; a `Thing`."""

    cutout: Cutout
    # x, z: [metres]
    x: float
    z: float
    size: float = 1.0  # against that of its picture

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

    def draw(self, canvas: NDArray[np.uint8], view: View) -> None:
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
    _, top, alpha = prop.coverage(Viewpoint(METRE, 0.0, 0.0, 0.0))
    height, width = alpha.shape
    black = np.zeros((height, width, 3), np.uint8)
    prop.draw(black, Viewpoint(METRE, 0.0, horizon=-top, centre=width / 2))
    cover = alpha / 255
    colour = black / np.maximum(cover, 1 / 255)[..., None]
    return Cutout(Sprite(colour, cover), float(-top))
