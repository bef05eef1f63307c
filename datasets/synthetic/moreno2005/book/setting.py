"""All that a scene is made of, and what is seen of the book in a frame."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.book import Book, Surface, self_shadow
from datasets.synthetic.moreno2005.book.hand import Hand, lit_hand
from datasets.synthetic.moreno2005.book.light import (
    AROUND,
    STRAIGHT,
    drawn_illuminants,
    drawn_lamp,
)
from datasets.synthetic.moreno2005.book.plan import FRAMES, SIZE, Plan, drawn_plan
from datasets.synthetic.moreno2005.book.room import lit_room
from datasets.synthetic.render.triangles import Mesh, Seen, seen
from datasets.synthetic.scene import part_generator

__all__ = ["Setting"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]


class Setting:
    """What the variants of a scene have in common.

    Parameters
    ----------
    seed : int
        Of all that is drawn at random.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.lamp = drawn_lamp(self._random("lamp"))
        self.book = Book(self._random("book"))

    @cached_property
    def plan(self) -> Plan:
        """How the book moves and bends."""
        return drawn_plan(self._random("plan"), self.book.height, float(np.sign(self.lamp[0])))

    @cached_property
    def illuminants(self) -> Array:
        """Colour of the light that changes, shape (FRAMES, 3)."""
        return drawn_illuminants(self._random("illuminant"))

    @cached_property
    def room(self) -> Floats:
        """What stands still, in white light, shape (height, width, 3)."""
        return lit_room(self._random("room"), self.lamp)

    @cached_property
    def hand(self) -> Hand:
        """What holds the book, in white light."""
        return lit_hand(self._random("hand"), self.lamp)

    def surface(self, frame: int) -> Surface:
        """The book in a frame."""
        return self.book.surface(self.plan.bendings[frame], self.plan.poses[frame], self.lamp)

    def seen(self, frame: int, shaded: bool) -> Seen:
        """What would be seen of the book without the hand, `shaded` or lit as if it were flat."""
        surface = self.surface(frame)
        light = np.full(len(surface.points), AROUND + STRAIGHT * self.lamp[2])
        if shaded:
            open_ = 0.7 + 0.3 * surface.normals[:, 2]
            light = AROUND * open_ + STRAIGHT * surface.straight
        return seen(self._mesh, surface.points, np.repeat(light[:, None], 3, axis=1), SIZE)

    @cached_property
    def truth(self) -> tuple[Array, Array, Array]:
        """Boxes, visibility, and the front's part in its own shadow, in every frame."""
        boxes, visibility, shadow = np.empty((FRAMES, 4)), np.empty(FRAMES), np.empty(FRAMES)
        for frame in range(FRAMES):
            surface = self.surface(frame)
            low, high = (ends(surface.points[:, :2], axis=0) for ends in (np.min, np.max))
            boxes[frame] = *low, *(high - low)
            book = self.seen(frame, shaded=False)
            hidden = self.hand.at(self.plan.poses[frame])[..., 3][book.window]
            whole = book.sheet[..., 3].sum(dtype=np.float64)
            visibility[frame] = 1 - (book.sheet[..., 3] * hidden).sum(dtype=np.float64) / whole
            shadow[frame] = self_shadow(surface, self.lamp)
        return boxes, visibility, shadow

    @cached_property
    def _mesh(self) -> Mesh:
        return self.book.mesh(self._random("cover"))

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/book {part}")
