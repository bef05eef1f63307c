"""All that is seen in a scene, looked at once: what stands still, and what is carried over it."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.render.colours import CUPS, nearly
from trackmark.datasets.synthetic.render.finish import Thing, painted
from trackmark.datasets.synthetic.render.solids import NOTHING, what_is_seen
from trackmark.datasets.synthetic.scene import part_generator
from trackmark.datasets.synthetic.wang2010.cup.plan import SIZE, WALL, drawn_plan
from trackmark.datasets.synthetic.wang2010.cup.things import (
    bare_room,
    carton,
    held_cup,
    similar_things,
    stores,
)

Array = NDArray[np.float64]

FINE = 4
"""Samples a pixel of the picture, in either direction."""


class Layer:
    """A picture that is carried over others by its `anchor`, a point from its left top [pixels].

    It is a uint8 array of `FINE` samples a pixel with zeros where there is nothing; it need not
    have the size of what it is laid over.
    """

    def __init__(self, picture: NDArray[np.uint8], anchor: ArrayLike) -> None:
        self._picture = picture
        self._anchor = np.asarray(anchor, np.float64)

    def at(self, place: ArrayLike, tilt: float) -> NDArray[np.float64]:
        """What is seen of it with its anchor at a place [pixels], tilted to the right [radians].

        In [0, 1], shape (height, width) or (height, width, channels) of the whole picture.
        """
        turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
        middle = FINE * np.asarray(place, np.float64) - 0.5
        shift = FINE * self._anchor - 0.5 - turn @ middle
        canvas = FINE * SIZE[0], FINE * SIZE[1]
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        matrix = np.column_stack([turn, shift])
        return smaller(cv2.warpAffine(self._picture, matrix, canvas, flags=flags))

    def extents(
        self, places: NDArray[np.float64], tilts: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Tight boxes around what is there, placed as by `at`, shape (n, 4) [pixels]."""
        rows, columns = np.nonzero(self._picture)
        ends = [(columns + u, rows + v) for u in (0, 1) for v in (0, 1)]
        corners = np.concatenate([np.stack(end, axis=1) for end in ends]).astype(np.int32)
        outline = cv2.convexHull(corners)[:, 0] / FINE - self._anchor
        cosine, sine = np.cos(tilts)[:, None], np.sin(tilts)[:, None]
        x = places[:, :1] + cosine * outline[:, 0] - sine * outline[:, 1]
        y = places[:, 1:] + sine * outline[:, 0] + cosine * outline[:, 1]
        left, top = x.min(axis=1), y.min(axis=1)
        return np.stack([left, top, x.max(axis=1) - left, y.max(axis=1) - top], axis=1)


def smaller(picture: NDArray[Any], fine: int = FINE) -> NDArray[np.float64]:
    """Means over the samples of each pixel, in [0, 1]."""
    height, width = picture.shape[0] // fine, picture.shape[1] // fine
    means = cv2.resize(picture.astype(np.float64), (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(means / 255)


Corner: TypeAlias = tuple[float, float]

STILL_FINE = 3
"""Samples a pixel of what stands still, in either direction."""

CUP_CORNER, CUP_SIZE = (-14, -13), (28, 26)
"""What holds the cup: left top from its middle, and size [pixels]."""

ARM_SIZE = 112, 66
"""What holds the cup with hand and arm; it begins a little above the cup [pixels]."""


class Setting:
    """A kitchen and a held cup, in numbers (`plan`) and looked at. Nothing in it is mirrored.

    `colour` is the cup's, BGR in [0, 255].
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = drawn_plan(self._random("plan"))
        random = self._random("cup")
        self.colour = nearly(random, CUPS[int(random.integers(len(CUPS)))], 0.06)

    @cached_property
    def carried(self) -> Layer:
        """Cup, hand and arm, by the middle of the cup; BGR and coverage."""
        left = CUP_CORNER[0] if self.plan.cup.hand > 0 else -CUP_CORNER[0] - ARM_SIZE[0]
        top = CUP_CORNER[1] - 2
        picture, _ = self._look(self._held, (left, top + self._rise), ARM_SIZE, FINE)
        return Layer(picture, (-left, -top))

    @cached_property
    def silhouettes(self) -> tuple[Layer, Layer]:
        """The whole cup, and what the hand leaves of it, by the middle of the cup."""
        corner = CUP_CORNER[0], CUP_CORNER[1] + self._rise
        anchor = -CUP_CORNER[0], -CUP_CORNER[1]
        alone, held = (
            Layer(np.uint8(255) * (self._trace(things, corner, CUP_SIZE) == 0), anchor)
            for things in (self._held[:1], self._held)
        )
        return alone, held

    @cached_property
    def still(self) -> tuple[Array, Array]:
        """What is behind the cup, shape (height, width, 3), and the box before it.

        Both in [0, 1]; the box, shape (height, width, 4), is premultiplied by its coverage.
        Its shadow is on what is behind.
        """
        random = self._random("room")
        room = bare_room(random, self.colour, random.random() < 0.5)
        room += [*self._similar, *stores(self.plan, self._random("stores"), self.colour)]
        picture, which = self._look([*room, *self._carton], self._corner, SIZE, STILL_FINE)
        before = which == len(room)
        box = picture * before[..., None]
        rows, columns = (np.flatnonzero(before.any(axis=k)) // STILL_FINE for k in (1, 0))
        left, top = int(columns[0]), int(rows[0])
        size = int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top
        corner = self._corner[0] + left, self._corner[1] + top
        uncovered, _ = self._look(room, corner, size, STILL_FINE)
        there = np.ix_(*(
            np.arange(STILL_FINE * start, STILL_FINE * (start + length))
            for start, length in ((top, size[1]), (left, size[0]))
        ))  # fmt: skip
        picture[there] = np.where(before[there][..., None], uncovered, picture[there])
        return smaller(picture[..., :3], STILL_FINE), smaller(box, STILL_FINE)

    @cached_property
    def hidden(self) -> Array:
        """Part of each pixel that the box before the cup covers, shape (height, width)."""
        return self._coverage(self._carton)

    @cached_property
    def similar(self) -> Array:
        """Part of each pixel that the thing of nearly the cup's colour covers, as `hidden`."""
        return self._coverage(self._similar[:1])

    @cached_property
    def _held(self) -> list[Thing]:
        return held_cup(self.plan.cup, self.colour, self._random("hand"))

    @cached_property
    def _carton(self) -> list[Thing]:
        return [carton(self.plan, self._random("box"), self.colour)]

    @cached_property
    def _similar(self) -> list[Thing]:
        return similar_things(self.plan, self._random("cloth"), self.colour)

    @property
    def _rise(self) -> float:
        """Row of the cup's middle where its foot stands at the origin [pixels]."""
        return float(self.plan.view.row(self.plan.cup.height / 2, 0.0))

    @property
    def _corner(self) -> Corner:
        """Left top of the picture from the origin [pixels]."""
        return -SIZE[0] / 2, float(self.plan.view.row(0.0, WALL)) - self.plan.horizon

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"kitchen {part}")

    def _coverage(self, things: Sequence[Thing]) -> Array:
        return smaller(255.0 * (self._trace(things, self._corner, SIZE) != NOTHING))

    def _trace(
        self, things: Sequence[Thing], corner: Corner, size: tuple[int, int]
    ) -> NDArray[np.int64]:
        solids = [thing.solids for thing in things]
        which, _, _ = what_is_seen(solids, self.plan.view, corner, size, FINE, shaded=False)
        return which

    def _look(
        self, things: Sequence[Thing], corner: Corner, size: tuple[int, int], fine: int
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        solids = [thing.solids for thing in things]
        which, places, lights = what_is_seen(solids, self.plan.view, corner, size, fine)
        return painted([thing.finish for thing in things], which, places, lights), which
