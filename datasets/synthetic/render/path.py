"""Smooth trajectories as functions of time."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from trackmark.datasets.interface import Array

# positions are multiples of this step, so that images agree with the ground truth [pixels]
POSITION_STEP = 1 / 64

SAMPLES_PER_SPAN = 64


def quantised(positions: Array) -> Array:
    """Round positions to multiples of `POSITION_STEP`."""
    return np.round(positions / POSITION_STEP) * POSITION_STEP


class Loop:
    """Closed smooth curve that is traversed at a constant speed [pixels/frame].

    The curve is a uniform cubic B-spline with the control points `points`, shape (k, 2) [pixels].
    It lies in their convex hull.
    """

    def __init__(self, points: Array, speed: float) -> None:
        u = (np.arange(SAMPLES_PER_SPAN) / SAMPLES_PER_SPAN)[:, None]
        v = 1 - u
        a, b, c, d = (np.roll(points, -shift, axis=0)[:, None] for shift in range(4))
        spans = (
            v * v * v * a
            + (3 * u * u * u - 6 * u * u + 4) * b
            + (3 * v * v * v - 6 * v * v + 4) * c
            + u * u * u * d
        ) / 6
        curve = spans.reshape(-1, 2)
        self._curve = np.vstack([curve, curve[:1]])
        steps = np.diff(self._curve, axis=0)
        chords = np.sqrt(steps[:, 0] * steps[:, 0] + steps[:, 1] * steps[:, 1])
        self._travelled = np.concatenate([[0.0], np.cumsum(chords)])
        self._speed = speed

    def positions(self, times: ArrayLike) -> Array:
        """Return positions (x, y) [pixels] at times [frames], shape `times.shape + (2,)`."""
        travelled = np.mod(np.asarray(times, np.float64) * self._speed, self._travelled[-1])
        coordinates = [
            np.interp(travelled, self._travelled, self._curve[:, axis]) for axis in range(2)
        ]
        return np.stack(coordinates, axis=-1)


def random_loop(
    generator: Generator, low: ArrayLike, high: ArrayLike, speed: float, corners: int = 7
) -> Loop:
    """Return a random loop within a rectangle, around its centre, in a random direction.

    `low` and `high` are corners (x, y) of the rectangle [pixels]. The speed is in pixels/frame, and
    `corners` is the number of control points.
    """
    angles = (np.arange(corners) + generator.uniform(-0.3, 0.3, corners)) * (2 * np.pi / corners)
    angles = generator.choice([-1.0, 1.0]) * angles + generator.uniform(0, 2 * np.pi)
    radius = generator.uniform(0.35, 1.0, corners)[:, None]
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return Loop(quantised((low + high) / 2 + radius * directions * (high - low) / 2), speed)


def smooth_step(values: Array, start: float, end: float) -> Array:
    """Return a cubic transition from 0 at `start` to 1 at `end`, constant outside."""
    u = np.clip((values - start) / (end - start), 0.0, 1.0)
    return u * u * (3 - 2 * u)


def random_positions(
    random: Generator, start: float, end: float, gaps: tuple[float, float]
) -> Iterator[float]:
    """Yield positions from `start` to `end`, sampling the gap to the next one on each request."""
    while start < end:
        yield start
        start += random.uniform(*gaps)
