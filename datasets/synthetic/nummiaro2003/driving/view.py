"""A pinhole camera that looks anywhere; where solids are for it, and the light on their facets.

World: x to the right, y up, z ahead; metres. A yaw or heading of 0 looks along z, of π/2 along x.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.facets import Facets, Lens, Pose

Array = NDArray[np.float64]

_STEP = 2.0**-30  # of sines and cosines: the same on every platform


@dataclass(frozen=True)
class View:
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

    def shifted(self, right: int, down: int) -> "View":
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


NEAREST = 0.6
"""Solids that come nearer to the camera than this have no extents [metres]."""

STAINS_SIDE = 512
"""Side of the picture of stains on the ground [pixels]."""

STAINS_PERIOD = 16.0
"""The picture of stains covers this side of the ground [metres]."""

_SKY = np.array([-0.05, 0.23, -0.08, 0.8])  # brightest above, and somewhat to the left
_DENSITY = STAINS_SIDE / STAINS_PERIOD * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def posed(
    view: View, facets: Facets, place: tuple[float, float, float] = (0, 0, 0), heading: float = 0.0
) -> Pose:
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
) -> Pose:
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
    return Pose(turn, apart, gains, shading)


@njit(cache=True)
def extents(facets: Facets, pose: Pose, lens: Lens) -> tuple[float, float, float, float, float]:
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
            if nearest < NEAREST:
                return 0.0, 0.0, 0.0, 0.0, nearest
            across = place[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
            down = place[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
            column = lens.column + lens.focal * across / ahead
            row = lens.row + lens.focal * down / ahead
            left, right = min(left, column), max(right, column)
            top, bottom = min(top, row), max(bottom, row)
    return left, right, top, bottom, nearest
