"""Ways of cars: straight on, in bends, slower where it bends."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Bend", "Course", "Way", "unhurried"]

Array = NDArray[np.float64]

FRAMES_PER_SECOND = 25.0

_STEP = 0.05  # along a way [metres]
_EASE = 3.0  # way in which the steering wheel is turned [metres]

SIDEWAYS = 2.2
"""Acceleration in bends that drivers take [metres/second²]."""

BRAKING = 1.6
"""Acceleration along the way that they take [metres/second²]."""


@dataclass(frozen=True)
class Bend:
    """A stretch straight on, and the bend after it.

    Attributes
    ----------
    straight : float
        Up to the bend [metres].
    turn : float
        By how much it turns, to the right positive [radians].
    radius : float
        [metres].
    """

    straight: float
    turn: float = 0.0
    radius: float = 1.0


class Way:
    """A curve over the ground.

    Parameters
    ----------
    x, z : float
        Where it begins [metres].
    heading : float
        In which direction [radians].
    bends : sequence of Bend
    """

    def __init__(self, x: float, z: float, heading: float, bends: Sequence[Bend]) -> None:
        pieces = []
        for bend in bends:
            pieces.append(np.zeros(round(bend.straight / _STEP)))
            count = round(abs(bend.turn) * bend.radius / _STEP)
            if count:
                pieces.append(np.full(count, bend.turn / (count * _STEP)))
        sharp = np.concatenate(pieces)
        ease = np.hanning(round(_EASE / _STEP) + 2)[1:-1]
        self._curvature = np.convolve(sharp, ease / ease.sum(), "same")
        headings = heading + np.cumsum(self._curvature) * _STEP
        self._track = np.stack(
            [
                x + np.cumsum(np.sin(headings)) * _STEP,
                z + np.cumsum(np.cos(headings)) * _STEP,
                headings,
            ],
            axis=1,
        )
        self.length = (len(headings) - 1) * _STEP

    def at(self, travelled: Array) -> Array:
        """Place (x, z) and heading after a way [metres], shape (n, 3)."""
        grid = np.arange(len(self._track)) * _STEP
        return np.stack([np.interp(travelled, grid, line) for line in self._track.T], axis=1)

    def travelled(self, frames: int, top: float, end: float) -> Array:
        """Way driven by every frame, if the whole way is to take them all.

        Parameters
        ----------
        frames : int
            To drive the whole way in.
        top : float
            Speed straight on, against that in bends [metres/second].
        end : float
            Speed at the end [metres/second].

        Returns
        -------
        ndarray of float64, shape (frames,)
            Speeds are as a driver has them, all times the factor that makes the times meet.
        """
        speed = self._speeds(top, end)
        middle = (speed[1:] + speed[:-1]) / 2
        times = np.concatenate([[0.0], np.cumsum(_STEP / middle)])
        wanted = np.arange(frames) / (frames - 1) * times[-1]
        return np.asarray(np.interp(wanted, times, np.arange(len(times)) * _STEP))

    def _speeds(self, top: float, end: float) -> Array:
        bends = np.sqrt(SIDEWAYS / np.maximum(np.abs(self._curvature), 1e-6))
        return unhurried(np.minimum(top, bends), end)

    def driven(self, frames: int, start: float, top: float) -> Array:
        """Way driven by every frame from a place on it, at an ordinary driver's speeds.

        Parameters
        ----------
        frames : int
        start : float
            Place in the first frame [metres from the way's beginning].
        top : float
            Speed straight on [metres/second].

        Returns
        -------
        ndarray of float64, shape (frames,)
        """
        speed = self._speeds(top, top)
        middle = (speed[1:] + speed[:-1]) / 2
        times = np.concatenate([[0.0], np.cumsum(_STEP / middle)])
        grid = np.arange(len(times)) * _STEP
        begun = np.interp(start, grid, times)
        return np.asarray(np.interp(begun + np.arange(frames) / FRAMES_PER_SECOND, times, grid))


def unhurried(fastest: Array, end: float) -> Array:
    """Highest speeds along a way under a limit, with ordinary braking and speeding up."""
    speed = fastest.copy()
    speed[-1] = min(speed[-1], end)
    gain = 2 * BRAKING * _STEP
    for k in range(len(speed) - 2, -1, -1):
        speed[k] = min(speed[k], np.sqrt(speed[k + 1] * speed[k + 1] + gain))
    for k in range(1, len(speed)):
        speed[k] = min(speed[k], np.sqrt(speed[k - 1] * speed[k - 1] + gain))
    return speed


@dataclass(frozen=True)
class Course:
    """Where a car is in every frame.

    Attributes
    ----------
    x, z : ndarray of float64, shape (n,)
        Its middle on the ground [metres].
    heading : ndarray of float64, shape (n,)
        [radians].
    """

    x: Array
    z: Array
    heading: Array

    @classmethod
    def of(cls, frames: int, x: ArrayLike, z: ArrayLike, heading: float) -> Self:
        """Course of some frames in one heading; a place that is one number stays the same."""
        columns = (np.asarray(v, np.float64) for v in (x, z, heading))
        return cls(*(np.broadcast_to(column, frames) for column in columns))
