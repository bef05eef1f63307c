"""Ways of walkers over the ground, frame by frame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.path import quantised
from datasets.synthetic.render.pinhole import FRAMES_PER_SECOND

__all__ = ["Course", "straight", "walk"]

Array = NDArray[np.float64]

CYCLE = 1.42
"""Way walked in two steps at an ordinary pace [metres]."""

ORDINARY = 1.3
"""Speed at which the steps are as long as they get [metres/second]."""

REACHED = 0.8
"""A walker turns to his next point this near to the last one [metres]."""

FASTEST_TURN = math.radians(130) / FRAMES_PER_SECOND
"""[radians/frame]."""


@dataclass(frozen=True)
class Course:
    """Where someone is, how he is turned and in which phase of his gait, in every frame.

    Attributes
    ----------
    x, z : ndarray of float64, shape (n,)
        Place on the ground: to the right, and away from the camera [metres].
    heading : ndarray of float64, shape (n,)
        0 is to the right, pi / 2 towards the camera; continuous [radians].
    phase : ndarray of float64, shape (n,)
        Gait cycles of two steps since some beginning.
    stride : ndarray of float64, shape (n,)
        Length of the steps, in [0, 1].
    """

    x: Array
    z: Array
    heading: Array
    phase: Array
    stride: Array

    @classmethod
    def through(cls, x: Array, z: Array, phase: float) -> Self:
        """Course through places that are given for every frame; it starts in a phase."""
        dx, dz = np.gradient(x), np.gradient(z)
        step = np.sqrt(dx * dx + dz * dz)
        stride = np.clip(step * FRAMES_PER_SECOND / ORDINARY, 0, 1)
        # Slow walkers make shorter steps, and not quite so many.
        cycles = step / (CYCLE * (0.35 + 0.65 * stride))
        return cls(
            x,
            z,
            quantised(np.unwrap(np.arctan2(-dz, dx))),
            quantised(phase + np.cumsum(cycles) - cycles[0]),
            quantised(stride),
        )


def straight(
    frames: int, at: int, place: tuple[float, float], velocity: tuple[float, float], phase: float
) -> Course:
    """Course that passes a place (x, z) [metres] in frame `at`; velocity in metres/second."""
    elapsed = (np.arange(frames) - at) / FRAMES_PER_SECOND
    x, z = (start + way * elapsed for start, way in zip(place, velocity, strict=True))
    return Course.through(x, z, phase)


def walk(
    frames: int,
    start: tuple[float, float],
    points: Iterator[tuple[float, float]],
    speed: float,
    phase: float,
) -> Course:
    """Course from point to point (x, z) [metres], as people walk: in arcs, slower in bends.

    Parameters
    ----------
    frames : int
    start : tuple of float
        Place in the first frame.
    points : iterator of tuple of float
        Where the walker turns to; he need not come nearer than 0.8 m.
    speed : float
        Where he walks straight on [metres/second].
    phase : float
        Of the gait in the first frame [cycles].
    """
    x, z = start
    goal = next(points)
    heading = math.atan2(goal[1] - z, goal[0] - x)
    track = np.empty((frames, 2))
    for place in track:
        place[:] = x, z
        while math.hypot(goal[0] - x, goal[1] - z) < REACHED:
            goal = next(points)
        error = math.remainder(math.atan2(goal[1] - z, goal[0] - x) - heading, math.tau)
        turn = min(max(0.14 * error, -FASTEST_TURN), FASTEST_TURN)
        heading += turn
        step = speed * (1 - 0.45 * abs(turn) / FASTEST_TURN) / FRAMES_PER_SECOND
        x += step * math.cos(heading)
        z += step * math.sin(heading)
    return Course.through(track[:, 0], track[:, 1], phase)
