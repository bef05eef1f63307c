"""All that is seen in a scene, looked at once: the room, what is held, what passes."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nguyen2002.lights.card import Card
from datasets.synthetic.nguyen2002.lights.held import drawn_printed, held
from datasets.synthetic.nguyen2002.lights.passers import HALF_HEIGHT, HALF_WIDTH, passer
from datasets.synthetic.nguyen2002.lights.plan import SIZE, drawn_plan
from datasets.synthetic.render.desk import WALL, room
from datasets.synthetic.render.finish import PITCH, Surface, Thing, looked_at
from datasets.synthetic.scene import part_generator

__all__ = ["HELD", "PASSING", "ROOM_FINE", "Setting"]

Array = NDArray[np.float64]

HELD, PASSING = 15.0, 43.0
"""How far towards the camera what is held is, and what passes [pixels]."""

HORIZON = 180
"""Row in which the wall meets the desk [pixels]."""

CARD_FINE, ROOM_FINE = 3, 2
"""Samples a pixel of what moves and of what stands still, in either direction."""

CORNER, EXTENT = (-45, -56), (90, 112)
"""What holds the object: left top from its origin, and size [pixels]."""

HELD_CORNER, HELD_SIZE = (-125, -56), (250, 272)
"""What holds the object, hand and arm: as `CORNER` and `EXTENT` [pixels]."""


class Setting:
    """A room and what moves in it, whatever light is on it.

    Parameters
    ----------
    seed : int
        Of all that is drawn at random.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = drawn_plan(self._random("plan"))

    @cached_property
    def carried(self) -> Card:
        """Object, hand and arm: colour, and normal with gloss; by the middle of the object."""
        surface = looked_at(self._things, HELD_CORNER, HELD_SIZE, CARD_FINE)
        return Card(surface.reduced(1), self._middle - HELD_CORNER, CARD_FINE)

    @cached_property
    def silhouette(self) -> Card:
        """What is seen of the object in the hand, nothing, nothing, the whole object."""
        whole, seen = self._outlines
        sheet = np.stack([seen, 0 * seen, 0 * seen, whole], axis=2)
        return Card([sheet.astype(np.float32)], self._middle - CORNER, CARD_FINE)

    @property
    def extent(self) -> Array:
        """Width and height of the whole object at scale 1 [pixels], shape (2,)."""
        low, high = self._bounds
        return high - low

    @property
    def points(self) -> tuple[Array, int]:
        """Where the object is seen in the hand, from its middle, and all its samples.

        Returns
        -------
        points : ndarray of float64, shape (n, 2)
            [pixels]
        count : int
            Samples of the whole object.
        """
        every = slice(CARD_FINE // 2, None, CARD_FINE)  # one a pixel
        whole, seen = (outline[every, every] for outline in self._outlines)
        rows, columns = np.nonzero(seen)
        points = np.stack([columns, rows], axis=1) + 0.5 + CORNER - self._middle
        return points, int(whole.sum())

    @cached_property
    def passers(self) -> list[Card]:
        """What passes, in order of time: as `carried`."""
        cards = []
        for k, passing in enumerate(self.plan.passings):
            things = passer(passing.kind, self._random(f"passer {k}"))
            size = 2 * HALF_WIDTH, 2 * HALF_HEIGHT
            surface = looked_at(things, (-HALF_WIDTH, -HALF_HEIGHT), size, ROOM_FINE)
            cards.append(Card(surface.reduced(1), (HALF_WIDTH, HALF_HEIGHT), ROOM_FINE))
        return cards

    @cached_property
    def room(self) -> Surface:
        """What stands still, `ROOM_FINE` samples a pixel."""
        corner = -SIZE[0] / 2, WALL * float(np.sin(PITCH)) - HORIZON
        return looked_at(room(self._random("room")), corner, SIZE, ROOM_FINE)

    @cached_property
    def _things(self) -> list[Thing]:
        """What is held, and hand and arm."""
        random = self._random("object")
        return held(drawn_printed(random), random)

    @cached_property
    def _outlines(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Samples of the whole object, and those that the hand leaves of it."""
        whole, seen = (
            looked_at(things, CORNER, EXTENT, CARD_FINE).which == 0
            for things in (self._things[:1], self._things)
        )
        return whole, seen

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        """Left top and right bottom of the whole object [pixels]."""
        whole, _ = self._outlines
        ends = [np.flatnonzero(whole.any(axis=axis)) for axis in (0, 1)]
        low, high = (np.array([end[k] for end in ends], np.float64) for k in (0, -1))
        return CORNER + low / CARD_FINE, CORNER + (high + 1) / CARD_FINE

    @property
    def _middle(self) -> Array:
        low, high = self._bounds
        return (low + high) / 2

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"nguyen2002/lights {part}")
