"""A pinhole camera that looks anywhere.

World: x to the right, y up, z ahead; metres. A yaw or heading of 0 looks along z, of π/2 along x.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["View", "heading_axes"]

Array = NDArray[np.float64]

_STEP = 2.0**-30  # of sines and cosines: the same on every platform


@dataclass(frozen=True)
class View:
    """Camera at one instant.

    Attributes
    ----------
    focal : float
        Focal length [pixels].
    centre : tuple of float
        Column and row of the optical axis [pixels].
    place : tuple of float
        Of the camera (x, y, z) [metres].
    yaw : float
        Direction of sight over the ground [radians].
    pitch : float
        Downwards [radians].
    """

    focal: float
    centre: tuple[float, float]
    place: tuple[float, float, float]
    yaw: float
    pitch: float

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
