"""What stands in a place or drives through it, as a renderer needs it."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.lighting import Lighting
from datasets.synthetic.nummiaro2003.driving.view import View

__all__ = ["NEAREST", "Thing", "Window", "from_far", "meet"]

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

    def draw(self, canvas: NDArray[np.uint8], view: View, lighting: Lighting) -> None:
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
