"""A pinhole camera that looks anywhere; where solids are for it, and the light on their facets.

World: x to the right, y up, z ahead; metres. A yaw or heading of 0 looks along z, of π/2 along x.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.shape import FacetPose, Facets, Lens
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.views import Viewpoint

Array = NDArray[np.float64]

_STEP = 2.0**-30  # of sines and cosines: the same on every platform


@dataclass(frozen=True)
class PerspectiveView:
    """Camera at one instant."""

    focal: float  # focal length [pixels]
    centre: tuple[float, float]  # column and row of the optical axis [pixels]
    place: tuple[float, float, float]  # of the camera (x, y, z) [metres]
    yaw: float  # direction of sight over the ground [radians]
    pitch: float  # downwards [radians]

    @cached_property
    def turn(self) -> Array:
        """From the world's axes to the camera's (right, down, ahead), shape (3, 3)."""
        (cos, sin), (level, down) = _direction(self.yaw), _direction(self.pitch)
        return np.array(
            [
                [cos, 0.0, -sin],
                [-sin * down, -level, -cos * down],
                [sin * level, -down, cos * level],
            ]
        )

    @property
    def horizon(self) -> float:
        """Row of the horizon [pixels]."""
        level, down = _direction(self.pitch)
        return self.centre[1] - self.focal * down / level

    def shifted(self, right: int, down: int) -> "PerspectiveView":
        """The same camera, its picture shifted by some pixels."""
        return replace(self, centre=(self.centre[0] + right, self.centre[1] + down))

    def seen_from(self, points: ArrayLike) -> Array:
        """Places (..., 3) in the camera's frame: right, down, ahead [metres]."""
        apart = np.asarray(points, np.float64) - self.place
        # Sums in a fixed order: the same bits on every platform.
        turn = self.turn
        return (
            apart[..., 0, None] * turn[:, 0]
            + apart[..., 1, None] * turn[:, 1]
            + apart[..., 2, None] * turn[:, 2]
        )

    def place_of(self, x: float, z: float) -> tuple[float, float, float]:
        """Column, row [pixels] and depth [metres] of a place on the ground; depth may be <= 0."""
        x, up, z = x - self.place[0], -self.place[1], z - self.place[2]
        right, down, ahead = (a * x + b * up + c * z for a, b, c in self._rows)
        scale = self.focal / ahead if ahead > 0 else 0.0
        return self.centre[0] + right * scale, self.centre[1] + down * scale, ahead

    @cached_property
    def _rows(self) -> list[list[float]]:
        rows: list[list[float]] = self.turn.tolist()
        return rows

    def project(self, points: ArrayLike) -> Array:
        """Column, row [pixels] and depth [metres] of places, shape (..., 3)."""
        right, down, ahead = np.moveaxis(self.seen_from(points), -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = self.focal / ahead
            return np.stack(
                [self.centre[0] + right * scale, self.centre[1] + down * scale, ahead], axis=-1
            )


def heading_axes(heading: float) -> Array:
    """From a solid's axes (right, up, ahead) to the world's, shape (3, 3)."""
    cos, sin = _direction(heading)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


def _direction(angle: float) -> tuple[float, float]:
    cos, sin = (float(np.round(f(angle) / _STEP) * _STEP) for f in (np.cos, np.sin))
    return cos, sin


NEAREST_SOLID = 0.6  # solids that come nearer to the camera than this have no extents [metres]
STAINS_SIDE = 512  # side of the picture of stains on the ground [pixels]
STAINS_PERIOD = 16.0  # the picture of stains covers this side of the ground [metres]
_SKY = np.array([-0.05, 0.23, -0.08, 0.8])  # brightest above, and somewhat to the left
_DENSITY = STAINS_SIDE / STAINS_PERIOD * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def posed(
    view: PerspectiveView,
    facets: Facets,
    place: tuple[float, float, float] = (0, 0, 0),
    heading: float = 0.0,
) -> FacetPose:
    """Pose of a solid that stands at a place, its axis in a heading."""
    eye, axes = np.array(view.place), heading_axes(heading)
    return _pose(view.turn, eye, axes, np.array(place, float), facets.normals, _SKY, _DENSITY)


@njit(cache=True)
def _pose(
    view: NDArray[np.float64],
    eye: NDArray[np.float64],
    axes: NDArray[np.float64],
    place: NDArray[np.float64],
    normals: NDArray[np.float64],
    sky: NDArray[np.float64],
    density: NDArray[np.float64],
) -> FacetPose:
    """Pose of a solid at a `place` for a camera at `eye` [metres].

    `view`, shape (3, 3), turns the world's axes to the camera's, `axes` the solid's to the world's;
    `normals` are those of its facets in its own frame. Light on a facet is `sky`: three factors of
    its normal in the world, and a constant. `density`, shape (2, 3), gives column and row in the
    picture of stains as factors of a place in the world.
    """
    turn, apart, shading = np.zeros((3, 3)), np.zeros(3), np.zeros((2, 4))
    for i in range(3):
        for k in range(3):
            for j in range(3):
                turn[i, j] += view[i, k] * axes[k, j]
            apart[i] += view[i, k] * (place[k] - eye[k])
    for i in range(2):
        for k in range(3):
            for j in range(3):
                shading[i, j] += density[i, k] * view[j, k]
            shading[i, 3] += density[i, k] * eye[k]
    gains = np.empty(len(normals), np.int64)
    for f in range(len(normals)):
        gain = sky[3]
        for k in range(3):
            for j in range(3):
                gain += sky[k] * axes[k, j] * normals[f, j]
        gains[f] = np.int64(np.floor(gain * 256 + 0.5))
    return FacetPose(turn, apart, gains, shading)


@njit(cache=True)
def extents(
    facets: Facets, pose: FacetPose, lens: Lens
) -> tuple[float, float, float, float, float]:
    """Lowest and highest column and row of a solid's corners, and the nearest one's depth.

    Where one of them is not clearly before the camera, columns and rows are 0.
    """
    turn, place = pose.turn, pose.place
    nearest = np.inf
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for f in range(len(facets.counts)):
        for k in range(facets.counts[f]):
            x, y, z = facets.corners[f, k]
            ahead = place[2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
            nearest = min(nearest, ahead)
            if nearest < NEAREST_SOLID:
                return 0.0, 0.0, 0.0, 0.0, nearest
            across = place[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
            down = place[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
            column = lens.column + lens.focal * across / ahead
            row = lens.row + lens.focal * down / ahead
            left, right = min(left, column), max(right, column)
            top, bottom = min(top, row), max(bottom, row)
    return left, right, top, bottom, nearest


# Left, top, right and bottom of some pixels, the last two excluded.
Window = tuple[int, int, int, int]
NEAREST_DRAWN = 2.0  # things nearer to the camera than this are not drawn [metres]


class Drawable(Protocol):
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

    def window(self, view: PerspectiveView) -> Window | None:
        """Pixels that it may be seen in, wherever they lie; None behind the camera."""
        ...

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Draw it over a canvas, which is changed in place."""
        ...


def from_far(things: list[Drawable], view: PerspectiveView, width: int) -> list[Drawable]:
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


METRE = 40.0  # pixels a metre of the pictures


@dataclass(frozen=True)
class Cutout:
    """Picture of a thing without what is behind it."""

    sprite: Sprite
    foot: float  # row at which it stands [pixels]


@dataclass(frozen=True)
class Standing:
    """A thing that stands upright at a place and faces the camera; a `Drawable`."""

    cutout: Cutout
    # x, z: [metres]
    x: float
    z: float
    size: float = 1.0  # against that of its picture

    @property
    def reach(self) -> float:
        return float(self.cutout.sprite.width / 2 * self.size / METRE)

    def window(self, view: PerspectiveView) -> Window | None:
        column, row, depth = view.place_of(self.x, self.z)
        if depth < NEAREST_DRAWN:
            return None
        scale = view.focal / depth * self.size / METRE
        half, top = self.cutout.sprite.width / 2 * scale, row - self.cutout.foot * scale
        return (
            math.floor(column - half) - 1,
            math.floor(top) - 1,
            math.ceil(column + half) + 1,
            math.ceil(top + self.cutout.sprite.height * scale) + 1,
        )

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        column, row, depth = view.place_of(self.x, self.z)
        if depth >= NEAREST_DRAWN:
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
