"""All that is seen in a scene, looked at once: the room, what is held, what passes."""

from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.nguyen2002.lights.plan import SIZE, drawn_plan
from trackmark.datasets.synthetic.nguyen2002.lights.things import (
    HALF_HEIGHT,
    HALF_WIDTH,
    held,
    passer,
)
from trackmark.datasets.synthetic.render.desk import seen_room
from trackmark.datasets.synthetic.render.finish import (
    VIEW,
    SceneObject,
    SurfaceBuffer,
    render_surfaces,
)
from trackmark.datasets.synthetic.render.solids import cast_rays
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

HELD, PASSING = 15.0, 43.0  # how far towards the camera what is held is, and what passes [pixels]
HORIZON = 180  # row in which the wall meets the desk [pixels]
# Samples a pixel of what moves and of what stands still, in either direction.
CARD_FINE, ROOM_FINE = 3, 2
CARD_LAID = 2  # samples a pixel in which a card is laid into the picture, in either direction
# What holds the object: left top from its origin, and size [pixels].
CORNER, EXTENT = (-45, -56), (90, 112)
# What holds the object, hand and arm: as `CORNER` and `EXTENT` [pixels].
HELD_CORNER, HELD_SIZE = (-125, -56), (250, 272)


class CardPose:
    """Where a card is: place (2,) of its anchor [pixels], scale, tilt to the right [radians]."""

    def __init__(self, place: ArrayLike, scale: float = 1.0, tilt: float = 0.0) -> None:
        self._place = np.asarray(place, np.float64)
        self._scale = scale
        self._turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])

    def onto_picture(self, points: Array) -> Array:
        """From the card, counted from its anchor, to the picture [pixels]; shape (n, 2)."""
        return np.asarray(self._place + self._scale * points @ self._turn.T)

    def onto_card(self, anchor: Array, fine: int) -> Array:
        """From a place in the picture to that among the card's samples, shape (2, 3)."""
        back = fine / self._scale * self._turn.T
        return np.column_stack([back, fine * anchor - back @ self._place - 0.5])


class FlatCard:
    """A flat picture of something that moves, parallel to the camera's, around a point of it.

    Its sheets (fine * h, fine * w, 4) lie on one another, premultiplied by the coverage, which is
    the last channel of the first, with `fine` samples a pixel in either direction. The anchor (2,)
    is the point by which it is placed, from its left top corner [pixels].
    """

    def __init__(self, sheets: Sequence[Floats], anchor: ArrayLike, fine: int) -> None:
        self._sheets = sheets
        self._anchor = np.asarray(anchor, np.float64)
        self._fine = fine

    def at(self, pose: CardPose) -> list[Floats]:
        """Its sheets as they lie in the picture, each of shape (height, width, 4)."""
        matrix = pose.onto_card(self._anchor, self._fine)
        matrix[:, 2] += matrix[:, :2] @ np.full(2, 0.5 / CARD_LAID)
        matrix[:, :2] /= CARD_LAID
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = CARD_LAID * SIZE[0], CARD_LAID * SIZE[1]
        laid = [cv2.warpAffine(sheet, matrix, size, flags=flags) for sheet in self._sheets]
        return [
            np.asarray(cv2.resize(sheet, SIZE, interpolation=cv2.INTER_AREA), np.float32)
            for sheet in laid
        ]

    def may_be_seen(self, pose: CardPose) -> bool:
        """Return whether a part of it may lie in the picture."""
        height, width = self._sheets[0].shape[:2]
        corners = np.array([(x, y) for x in (-1, width + 1) for y in (-1, height + 1)])
        places = pose.onto_picture(corners / self._fine - self._anchor)
        return bool((places.max(axis=0) > 0).all() and (places.min(axis=0) < SIZE).all())

    def shade(self, softness: float = 0.0) -> "ShadowMask":
        """What it covers, its edges softened by a standard deviation [pixels]."""
        coverage = self._sheets[0][..., 3]
        if not softness:
            return ShadowMask(coverage, self._anchor, self._fine)
        margin = round(3 * softness) * self._fine
        soft = cv2.GaussianBlur(np.pad(coverage, margin), (0, 0), softness * self._fine)
        return ShadowMask(np.asarray(soft), self._anchor + margin / self._fine, self._fine)


class ShadowMask:
    """What a card covers, to be asked for at any points; arguments as of `FlatCard`."""

    def __init__(self, coverage: Floats, anchor: Array, fine: int) -> None:
        self._coverage = coverage
        self._anchor = anchor
        self._fine = fine

    def at(self, pose: CardPose, points: Floats) -> Floats:
        """Coverage in [0, 1] at points (h, w, 2) of the picture, columns and rows [pixels]."""
        places = cv2.transform(points, pose.onto_card(self._anchor, self._fine))
        columns, rows = (np.ascontiguousarray(places[..., k]) for k in (0, 1))
        return np.asarray(cv2.remap(self._coverage, columns, rows, cv2.INTER_LINEAR), np.float32)


class LightsSetting:
    """A room and what moves in it, whatever light is on it; all is drawn at random by a seed."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = drawn_plan(self._random("plan"))

    @cached_property
    def carried(self) -> FlatCard:
        """Object, hand and arm: colour, and normal with gloss; by the middle of the object."""
        surface = render_surfaces(self._things, HELD_CORNER, HELD_SIZE, CARD_FINE)
        return FlatCard(surface.reduced(1), self._middle - HELD_CORNER, CARD_FINE)

    @cached_property
    def silhouette(self) -> FlatCard:
        """What is seen of the object in the hand, nothing, nothing, the whole object."""
        whole, seen = self._outlines
        sheet = np.stack([seen, 0 * seen, 0 * seen, whole], axis=2)
        return FlatCard([sheet.astype(np.float32)], self._middle - CORNER, CARD_FINE)

    @property
    def extent(self) -> Array:
        """Width and height of the whole object at scale 1 [pixels], shape (2,)."""
        low, high = self._bounds
        return high - low

    @property
    def points(self) -> tuple[Array, int]:
        """Where the object is seen in the hand, from its middle, (n, 2) [pixels].

        And how many there would be of the whole object.
        """
        every = slice(CARD_FINE // 2, None, CARD_FINE)  # one a pixel
        whole, seen = (outline[every, every] for outline in self._outlines)
        rows, columns = np.nonzero(seen)
        points = np.stack([columns, rows], axis=1) + 0.5 + CORNER - self._middle
        return points, int(whole.sum())

    @cached_property
    def passers(self) -> list[FlatCard]:
        """What passes, in order of time: as `carried`."""
        cards = []
        for k, passing in enumerate(self.plan.passings):
            things = passer(passing.kind, self._random(f"passer {k}"))
            size = 2 * HALF_WIDTH, 2 * HALF_HEIGHT
            surface = render_surfaces(things, (-HALF_WIDTH, -HALF_HEIGHT), size, ROOM_FINE)
            cards.append(FlatCard(surface.reduced(1), (HALF_WIDTH, HALF_HEIGHT), ROOM_FINE))
        return cards

    @cached_property
    def room(self) -> SurfaceBuffer:
        """What stands still, `ROOM_FINE` samples a pixel."""
        return seen_room(self._random("room"), SIZE, HORIZON, ROOM_FINE)

    @cached_property
    def _things(self) -> list[SceneObject]:
        """What is held, and hand and arm."""
        return held(self._random("object"))

    @cached_property
    def _outlines(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Samples of the whole object, and those that the hand leaves of it."""
        solids = [thing.solids for thing in self._things]
        whole, seen = (
            cast_rays(things, VIEW, CORNER, EXTENT, CARD_FINE, shaded=False)[0] == 0
            for things in (solids[:1], solids)
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
