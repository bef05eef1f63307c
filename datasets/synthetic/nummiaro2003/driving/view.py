"""Pinhole camera with yaw and pitch, poses of solids, light on facets, upright cutouts.

World coordinates are x to the right, y up and z ahead [metres]. A yaw or heading of 0 points along
z, and one of π/2 along x.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import FacetPose, Facets, Lens
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.views import Viewpoint

_STEP = 2.0**-30  # Sines and cosines are rounded to multiples: all platforms render equal bytes.


@dataclass(frozen=True)
class PerspectiveView:
    """Pose and intrinsic parameters of a camera at one time."""

    focal: float  # focal length [pixels]
    centre: tuple[float, float]  # column and row of the optical axis [pixels]
    place: tuple[float, float, float]  # position of the camera (x, y, z) [metres]
    yaw: float  # horizontal viewing direction [radians]
    pitch: float  # downwards [radians]

    @cached_property
    def turn(self) -> Array:
        """Rotation from the world's axes to the camera's (right, down, ahead), shape (3, 3)."""
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
        """Return the camera with its optical axis moved right and down in the image [pixels]."""
        return replace(self, centre=(self.centre[0] + right, self.centre[1] + down))

    def seen_from(self, points: ArrayLike) -> Array:
        """Transform points (..., 3) to camera coordinates: right, down, ahead [metres]."""
        offsets = np.asarray(points, np.float64) - self.place
        # The order of the sums is fixed, so that all platforms return equal bits.
        turn = self.turn
        return (
            offsets[..., 0, None] * turn[:, 0]
            + offsets[..., 1, None] * turn[:, 1]
            + offsets[..., 2, None] * turn[:, 2]
        )

    def place_of(self, x: float, z: float) -> tuple[float, float, float]:
        """Return column, row [pixels] and depth [metres] of a ground point; depth can be < 0."""
        x, up, z = x - self.place[0], -self.place[1], z - self.place[2]
        right, down, ahead = (a * x + b * up + c * z for a, b, c in self._rows)
        scale = self.focal / ahead if ahead > 0 else 0.0
        return self.centre[0] + right * scale, self.centre[1] + down * scale, ahead

    @cached_property
    def _rows(self) -> list[list[float]]:
        rows: list[list[float]] = self.turn.tolist()
        return rows

    def project(self, points: ArrayLike) -> Array:
        """Return column, row [pixels] and depth [metres] of points, shape (..., 3)."""
        right, down, ahead = np.moveaxis(self.seen_from(points), -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = self.focal / ahead
            return np.stack(
                [self.centre[0] + right * scale, self.centre[1] + down * scale, ahead], axis=-1
            )


def heading_axes(heading: float) -> Array:
    """Return the rotation from a solid's axes (right, up, ahead) to the world's, shape (3, 3)."""
    cos, sin = _direction(heading)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


def _direction(angle: float) -> tuple[float, float]:
    cos, sin = (float(np.round(f(angle) / _STEP) * _STEP) for f in (np.cos, np.sin))
    return cos, sin


NEAREST_SOLID = 0.6  # solids with a corner nearer than this have no extents [metres]
STAINS_SIDE = 512  # side of the texture of stains on the ground [pixels]
STAINS_PERIOD = 16.0  # side of the ground area that this texture covers [metres]
# light on a facet: factors of its normal (x, y, z), and a constant
_SKY = np.array([-0.05, 0.23, -0.08, 0.8])
_DENSITY = STAINS_SIDE / STAINS_PERIOD * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def facet_pose(
    view: PerspectiveView,
    facets: Facets,
    place: tuple[float, float, float] = (0, 0, 0),
    heading: float = 0.0,
) -> FacetPose:
    """Return the pose of a solid at the position `place` [metres] in a heading [radians]."""
    eye, axes = np.array(view.place), heading_axes(heading)
    return _pose(view.turn, eye, axes, np.array(place, float), facets.normals, _SKY, _DENSITY)


@njit(cache=True)
def _pose(
    view: Array, eye: Array, axes: Array, place: Array, normals: Array, sky: Array, density: Array
) -> FacetPose:
    """Return the pose of a solid at the position `place` for a camera at `eye` [metres].

    `view`, shape (3, 3), rotates the world's axes to the camera's axes. `axes`, shape (3, 3),
    rotates the solid's axes to the world's axes. `normals` are the facet normals in the solid's
    axes. `sky` is described at `_SKY`. `density`, shape (2, 3), contains the factors that turn a
    world position into column and row of the texture of stains.
    """
    turn, offset, shading = np.zeros((3, 3)), np.zeros(3), np.zeros((2, 4))
    for i in range(3):
        for k in range(3):
            for j in range(3):
                turn[i, j] += view[i, k] * axes[k, j]
            offset[i] += view[i, k] * (place[k] - eye[k])
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
    return FacetPose(turn, offset, gains, shading)


@njit(cache=True)
def facet_extents(
    facets: Facets, pose: FacetPose, lens: Lens
) -> tuple[float, float, float, float, float]:
    """Return left, right, top and bottom of a solid in the image, and its minimum depth.

    The first four values are 0 if a corner is nearer than NEAREST_SOLID.
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


Window = tuple[int, int, int, int]  # left, top, right, bottom [pixels]; right, bottom are exclusive
NEAREST_DRAWN = 2.0  # minimum depth of drawn objects [metres]


class Drawable(Protocol):
    """Object at a position on the ground."""

    @property
    def x(self) -> float:
        """Position of the centre, to the right [metres]."""
        ...

    @property
    def z(self) -> float:
        """Position of the centre, ahead [metres]."""
        ...

    @property
    def reach(self) -> float:
        """Maximum horizontal distance of a part from the centre [metres]."""
        ...

    def window(self, view: PerspectiveView) -> Window | None:
        """Return a window around the object, also outside the image; None behind the camera."""
        ...

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Draw the object over a canvas in place."""
        ...


def sort_from_far(things: list[Drawable], view: PerspectiveView, width: int) -> list[Drawable]:
    """Return the objects that may be visible in an image of `width` pixels, farthest first."""
    x, z, reach = np.array([(thing.x, thing.z, thing.reach) for thing in things]).T
    right, _, ahead = view.seen_from(np.stack([x, np.zeros(len(x)), z], axis=1)).T
    # `edge` is the tangent of half the field of view.
    edge = width / 2 / view.focal
    may_be_visible = (ahead > -reach) & (np.abs(right) < edge * (ahead + reach) + 1.2 * reach)
    squared_distances = right * right + ahead * ahead
    return [things[i] for i in np.argsort(-squared_distances, kind="stable") if may_be_visible[i]]


def windows_meet(first_window: Window, second_window: Window) -> bool:
    """Return whether two windows overlap."""
    return (
        first_window[0] < second_window[2]
        and second_window[0] < first_window[2]
        and first_window[1] < second_window[3]
        and second_window[1] < first_window[3]
    )


METRE = 40.0  # scale of the images of cutouts [pixels/metre]


@dataclass(frozen=True)
class Cutout:
    """Image of an object with a transparent background."""

    sprite: Sprite
    foot: float  # row of its base [pixels]


@dataclass(frozen=True)
class UprightCutout:
    """Upright image at a position, always facing the camera; implements `Drawable`."""

    cutout: Cutout
    x: float  # to the right [metres]
    z: float  # ahead [metres]
    size: float = 1.0  # size relative to the image

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


def paint_cutout(
    make: Callable[[Generator, float, float, float], Prop], random: Generator
) -> Cutout:
    """Return an image of a street object, painted with METRE pixels per metre."""
    prop = make(random, 0.0, 1.0, METRE)
    _, top, alpha = prop.coverage(Viewpoint(METRE, 0.0, 0.0, 0.0))
    height, width = alpha.shape
    black = np.zeros((height, width, 3), np.uint8)
    prop.draw(black, Viewpoint(METRE, 0.0, horizon=-top, centre=width / 2))
    cover = alpha / 255
    colour = black / np.maximum(cover, 1 / 255)[..., None]
    return Cutout(Sprite(colour, cover), float(-top))
