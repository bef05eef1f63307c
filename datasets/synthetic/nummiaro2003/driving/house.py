"""Houses: walls with windows in storeys, and a roof."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.facets import (
    Face,
    Ring,
    assembled,
    between,
    flat,
    packed,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import View
from trackmark.datasets.synthetic.render.texture import fractal, noise

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, top, right and bottom [metres]."""

LOOKS = 6
"""Kinds of walls and roofs in a place."""

STOREY = 2.9
"""Height of a storey [metres]."""

_WALLS = (
    (72, 84, 150),  # brick
    (62, 70, 122),  # dark brick
    (164, 190, 206),  # cream
    (190, 196, 200),  # light grey
    (130, 164, 190),  # ochre
    (150, 156, 158),  # concrete
    (104, 126, 146),  # sandstone
)
_ROOFS = ((62, 70, 100), (74, 70, 68), (88, 88, 92))

_BAYS = 4  # in a picture, side by side; two storeys of them
_SIZE = 512, 256  # of a picture of a wall [pixels]


@dataclass(frozen=True)
class House:
    """A house along the axes."""

    # x, z: its middle [metres]
    x: float
    z: float
    # width, depth: along x and along z [metres]
    width: float
    depth: float
    storeys: int  # ground floor included
    roof: float  # height of the roof; 0 is flat [metres]
    look: int  # number of its look, in [0, LOOKS)

    def faces(self) -> list[Face]:
        """Walls and roof."""
        half, end, high = self.width / 2, self.depth / 2, self.storeys * STOREY
        foot, first, eaves = (Ring(h, end, -end, half) for h in (0.0, STOREY, high))
        inset = min(half, end) - 0.4 if self.roof else 0.3
        brim = Ring(high, end + 0.35, -end - 0.35, half + 0.35)
        edge = brim if self.roof else eaves
        top = Ring(high + max(self.roof, 0.5), end - inset, inset - end, half - inset)
        floor, floor_side, wall, wall_side, roof = (5 * self.look + k for k in range(5))
        faces = [
            flat(top.height, (-top.half_width, top.half_width), (top.behind, top.ahead), roof),
            *between(edge, top, (roof, roof, roof)),
            *between(first, eaves, (wall, wall, wall_side)),
            *between(foot, first, (floor, floor, floor_side)),
        ]
        place = np.array([self.x, 0.0, self.z])
        return [replace(face, corners=face.corners + place) for face in faces]


class Houses:
    """Houses that are drawn together: `facets` in the world's frame, and the `pictures` on them."""

    def __init__(self, random: np.random.Generator, houses: Sequence[House]) -> None:
        faces = [house.faces() for house in houses]
        self._owners = np.repeat(np.arange(len(houses)), [len(own) for own in faces])
        self._places = np.array([(house.x, 0.0, house.z) for house in houses])
        self._reach = np.array([house.width + house.depth for house in houses]) / 2
        pictures, projections = [], []
        for _ in range(LOOKS):
            bay = random.uniform(2.6, 3.6)
            pictures += _look(random, bay)
            projections += _projections(bay)
        self.facets = assembled([face for own in faces for face in own], np.array(projections))
        self.pictures = packed(pictures)

    def order(self, view: View) -> NDArray[np.int64]:
        """Numbers of the facets of houses that may be seen, from the nearest house on."""
        right, _, ahead = view.seen_from(self._places).T
        seen = (ahead > -self._reach) & (np.abs(right) - self._reach < 0.8 * (ahead + self._reach))
        rank = np.argsort(np.argsort(right * right + ahead * ahead, kind="stable"))
        facets = np.flatnonzero(seen[self._owners])
        return facets[np.argsort(rank[self._owners[facets]], kind="stable")]


def any_house(
    random: np.random.Generator, x: float, z: float, width: float, depth: float, large: bool = False
) -> House:
    """House on a plot; a large one is an office with a flat roof. All in metres."""
    return House(
        x,
        z,
        width,
        depth,
        storeys=int(random.integers(3, 5)) if large else int(random.integers(2, 4)),
        roof=0.0 if large or random.random() < 0.15 else random.uniform(2.0, 3.2),
        look=int(random.integers(LOOKS)),
    )


def _projections(bay: float) -> list[list[list[float]]]:
    per_metre, up = _SIZE[0] / (_BAYS * bay), -_SIZE[1] / (2 * STOREY)
    across, along, rise = [per_metre, 0, 0, 0], [0, 0, per_metre, 0], [0, up, 0, 2.0 * _SIZE[1]]
    return [[across, rise], [along, rise], [across, rise], [along, rise],
            [[48.0, 0, 0, 0], [0, 60.0, 48.0, 0]]]  # fmt: skip


def _look(random: np.random.Generator, bay: float) -> list[Array]:
    """Ground floor and upper floors, each twice (for both axes), and the roof."""
    colour = np.array(_WALLS[random.integers(len(_WALLS))]) * random.uniform(0.86, 1.06)
    grain = fractal(random, 512, 16, 256, 0.8)[: _SIZE[1]]
    upper = _wall(random, colour, grain, bay, ground=False)
    lower = _wall(random, colour * 0.94, grain, bay, ground=True)
    tiles = np.array(_ROOFS[random.integers(len(_ROOFS))]) * np.ones((256, 256, 1))
    rows = np.arange(256)
    courses = 1 - 0.22 * (rows % 16 < 2)[:, None] - 0.08 * ((rows % 24) < 2)[None, :]
    tiles = tiles * (courses * (1 + 0.1 * noise(random, 256, 64)))[..., None]
    return [lower, lower, upper, upper, tiles]


def _wall(
    random: np.random.Generator, colour: Array, grain: Array, bay: float, ground: bool
) -> Array:
    """Two storeys of windows side by side; on the ground floor some are doors."""
    wall = _Sheet(colour, grain, bay)
    wide, tall = random.uniform(1.0, 1.5), random.uniform(1.25, 1.6)
    trim = colour * 0.5 + 116 if random.random() < 0.6 else colour * 0.6
    for storey in range(2):
        for number in range(_BAYS):
            middle, sill = (number + 0.5) * bay, storey * STOREY + 0.9
            if ground and number == 1:
                door = (middle - 0.5, 2.3, middle + 0.5, storey * STOREY)
                wall.framed(door, trim, colour * 0.35)
                continue
            glass = np.array([100.0, 90.0, 80.0]) * random.uniform(0.55, 1.1)
            left, right, top = middle - wide / 2, middle + wide / 2, sill + tall
            wall.framed((left, top, right, sill), trim, glass)
            shine = sill + tall * random.uniform(0.4, 0.8)
            wall.fill((left, top, right, shine), glass * 1.4 + 14)
            if random.random() < 0.5:
                cloth = np.full(3, 178.0 * random.uniform(0.7, 1.0))
                drawn = wide * random.uniform(0.15, 0.35)
                wall.fill((left, top, left + drawn, sill), cloth)
                wall.fill((right - drawn, top, right, sill), cloth)
            wall.fill((middle - 0.03, top, middle + 0.03, sill), trim)
            wall.fill((left - 0.1, sill, right + 0.1, sill - 0.1), trim)
    return wall.picture.astype(np.float64)


class _Sheet:
    """Picture of a wall, painted in metres from its left lower corner."""

    def __init__(self, colour: Array, grain: Array, bay: float) -> None:
        width, height = _SIZE
        picture = np.ascontiguousarray(np.broadcast_to(colour, (height, width, 3)))
        picture = picture * (1 + 0.07 * grain[..., None])
        if colour[2] > 1.25 * colour[0]:  # brick has courses
            picture[::7] *= 0.86
        self.picture = np.clip(picture, 0, 255).astype(np.uint8)
        self._across, self._up = width / (_BAYS * bay), height / (2 * STOREY)

    def fill(self, box: Box, colour: Array) -> None:
        height = len(self.picture)
        first = round(box[0] * self._across), round(height - box[1] * self._up)
        last = round(box[2] * self._across) - 1, round(height - box[3] * self._up) - 1
        cv2.rectangle(self.picture, first, last, colour.tolist(), -1)

    def framed(self, box: Box, trim: Array, colour: Array) -> None:
        left, top, right, bottom = box
        self.fill((left - 0.07, top + 0.07, right + 0.07, bottom), trim)
        self.fill(box, colour)
