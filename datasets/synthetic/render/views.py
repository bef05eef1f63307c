"""What the camera does: it stands fixed, or follows someone in a hand."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.course import Course
from datasets.synthetic.render.light import smooth_step
from datasets.synthetic.render.path import quantised
from datasets.synthetic.render.pinhole import FRAMES_PER_SECOND, SIZE, Camera

__all__ = ["Views", "fixed", "following", "wandering"]

Array = NDArray[np.float64]

SLOW = (2.5, 9.0)
"""Periods in which a hand and an eye wander [seconds]."""

QUICK = (0.28, 1.1)
"""Periods in which a hand shakes [seconds]."""


@dataclass(frozen=True)
class Views:
    """The camera in every frame.

    Attributes
    ----------
    still : Camera
        What does not change.
    x : ndarray of float64, shape (n,)
        Lateral place [metres].
    shift_x, shift_y : ndarray of float64, shape (n,)
        Shift of the picture by turning and shaking [pixels].
    """

    still: Camera
    x: Array
    shift_x: Array
    shift_y: Array

    def __getitem__(self, frame: int) -> Camera:
        """Camera in a frame."""
        x, right, down = (float(a[frame]) for a in (self.x, self.shift_x, self.shift_y))
        return replace(self.still, x=x, shift_x=right, shift_y=down)

    def rate(self, frame: int) -> tuple[float, tuple[float, float]]:
        """Travel [metres/frame] and the picture's shift [pixels/frame] around a frame."""
        last = len(self.x) - 1
        around = [max(frame - 1, 0), min(frame + 1, last)]
        travel, right, down = (
            float(a[around[1]] - a[around[0]]) / (around[1] - around[0])
            for a in (self.x, self.shift_x, self.shift_y)
        )
        return travel, (right, down)


def fixed(random: np.random.Generator, frames: int) -> Views:
    """Camera that stands somewhat above the heads."""
    still = Camera(
        focal=700.0,
        eye=random.uniform(2.9, 3.3),
        horizon=random.uniform(115, 132),
        centre=SIZE[0] / 2,
    )
    nothing = np.zeros(frames)
    return Views(still, nothing, nothing, nothing)


def following(random: np.random.Generator, course: Course) -> Views:
    """Camera in the hand of someone who walks along and keeps a walker in view, not well.

    He lags by half a second and wanders; he turns the camera slowly about, with a quick turn
    off the target and back now and then; his hand shakes and his steps are seen.
    """
    frames = len(course.x)
    still = Camera(
        focal=700.0,
        eye=random.uniform(1.5, 1.65),
        horizon=random.uniform(180, 200),
        centre=SIZE[0] / 2,
    )
    lag = round(random.uniform(0.4, 0.6) * FRAMES_PER_SECOND)
    x = quantised(_smoothed(course.x, lag) + wandering(random, frames, SLOW, 0.3))
    turn = wandering(random, frames, SLOW, 34) + wandering(random, frames, QUICK, 3.5)
    time = np.arange(frames, dtype=np.float64)
    for start in np.arange(random.uniform(60, 140), frames - 40, random.uniform(150, 220)):
        rise, hold, fall = random.uniform(7, 14), random.uniform(2, 15), random.uniform(10, 25)
        off = smooth_step(time, start, start + rise)
        back = smooth_step(time, start + rise + hold, start + rise + hold + fall)
        turn += random.choice([-1, 1]) * random.uniform(40, 80) * (off - back)
    nod = wandering(random, frames, SLOW, 9) + wandering(random, frames, QUICK, 2.5)
    beat = random.uniform(1.7, 2.0) / FRAMES_PER_SECOND
    nod += 2.2 * np.sin(2 * np.pi * (beat * time + random.uniform()))
    # The target stays in the picture: the further off he is, the more the turn gives way.
    aim = still.column(course.x - x, course.z) - still.centre
    room = 0.30 * SIZE[0]
    shift_x = room * np.tanh((aim + turn) / room) - aim
    return Views(still, x, quantised(shift_x), quantised(nod))


def _smoothed(values: Array, lag: int) -> Array:
    """Weighted mean of the last 2 `lag` + 1 values: late by `lag` frames, and smooth."""
    weights = np.hanning(2 * lag + 3)[1:-1]
    before = np.full(2 * lag, values[0])
    return np.convolve(np.concatenate([before, values]), weights / weights.sum(), "valid")


def wandering(
    random: np.random.Generator, frames: int, periods: Sequence[float], deviation: float
) -> Array:
    """Sum of five waves of random periods [seconds] with a standard deviation."""
    time = np.arange(frames) / FRAMES_PER_SECOND
    low, high = (float(np.log(period)) for period in periods)
    total = np.zeros(frames)
    for _ in range(5):
        period = float(np.exp(random.uniform(low, high)))
        total += np.sin(2 * np.pi * (time / period + random.uniform()))
    return total * deviation * float(np.sqrt(2 / 5))
