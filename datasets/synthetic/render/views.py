"""A street as a camera sees it: where people walk, and how it stands or follows one of them.

World: x to the right, height up from the ground, depth z away from the camera; metres.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.path import quantised, smooth_step

Array = NDArray[np.float64]

SIZE = 640, 480
"""Width and height of its images [pixels]."""

FRAMES_PER_SECOND = 25.0

Number = TypeVar("Number", float, NDArray[np.float64])


@dataclass(frozen=True)
class Viewpoint:
    """Where a camera is and looks at one instant, and what it makes of places in the world."""

    focal: float  # focal length [pixels]
    eye: float  # height above the ground [metres]
    horizon: float  # row of the horizon without shift [pixels]
    centre: float  # column of the optical axis without shift [pixels]
    x: float = 0.0  # lateral place [metres]
    # shift_x, shift_y: shift of the whole picture by turning and shaking, to the right and down
    # [pixels]
    shift_x: float = 0.0
    shift_y: float = 0.0

    def scale(self, z: Number) -> Number:
        """Pixels per metre at a depth [metres]."""
        return self.focal / z

    def column(self, x: Number, z: Number) -> Number:
        """Image column of a place at a depth, both in metres."""
        return self.centre + self.shift_x + (x - self.x) * self.scale(z)

    def row(self, height: Number, z: Number) -> Number:
        """Image row of a height above the ground at a depth, both in metres."""
        return self.horizon + self.shift_y + (self.eye - height) * self.scale(z)


CYCLE = 1.42
"""Way walked in two steps at an ordinary pace [metres]."""

ORDINARY = 1.3
"""Speed at which the steps are as long as they get [metres/second]."""

REACHED = 0.8
"""A walker turns to his next point this near to the last one [metres]."""

FASTEST_TURN = math.radians(130) / FRAMES_PER_SECOND
"""[radians/frame]."""


@dataclass(frozen=True)
class WalkingPath:
    """Where someone is, how he is turned and in which phase of his gait, in every frame."""

    # x, z: (n,), place on the ground: to the right, and away from the camera [metres]
    x: Array
    z: Array
    heading: Array  # (n,), 0 is to the right, pi / 2 towards the camera; continuous [radians]
    phase: Array  # (n,), gait cycles of two steps since some beginning
    stride: Array  # (n,), length of the steps, in [0, 1]

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

    def __getitem__(self, frames: slice | NDArray[np.int64]) -> Self:
        """The course in some of its frames, or in frames of some numbers."""
        columns = (self.x, self.z, self.heading, self.phase, self.stride)
        return type(self)(*(column[frames] for column in columns))


def straight_path(
    frames: int, at: int, place: tuple[float, float], velocity: tuple[float, float], phase: float
) -> WalkingPath:
    """Course that passes a place (x, z) [metres] in frame `at`; velocity in metres/second."""
    elapsed = (np.arange(frames) - at) / FRAMES_PER_SECOND
    x, z = (start + way * elapsed for start, way in zip(place, velocity, strict=True))
    return WalkingPath.through(x, z, phase)


def walk_through_points(
    frames: int,
    start: tuple[float, float],
    points: Iterator[tuple[float, float]],
    speed: float,
    phase: float,
) -> WalkingPath:
    """Course from point to point (x, z) [metres], as people walk: in arcs, slower in bends.

    `start` is the place in the first frame; he turns to the `points` one after the other and need
    not come nearer to them than 0.8 m. `speed` is where he walks straight on [metres/second],
    `phase` that of the gait in the first frame [cycles].
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
    return WalkingPath.through(track[:, 0], track[:, 1], phase)


SLOW = (2.5, 9.0)
"""Periods in which a hand and an eye wander [seconds]."""

QUICK = (0.28, 1.1)
"""Periods in which a hand shakes [seconds]."""


@dataclass(frozen=True)
class Views:
    """The camera in every frame."""

    still: Viewpoint  # what does not change
    x: Array  # (n,), lateral place [metres]
    # shift_x, shift_y: (n,), shift of the picture by turning and shaking [pixels]
    shift_x: Array
    shift_y: Array

    @classmethod
    def standing(cls, still: Viewpoint, frames: int) -> Self:
        """A camera that stands still in some frames."""
        nothing = np.zeros(frames)
        return cls(still, nothing, nothing, nothing)

    def __getitem__(self, frame: int) -> Viewpoint:
        """Viewpoint in a frame."""
        x, right, down = (float(a[frame]) for a in (self.x, self.shift_x, self.shift_y))
        return replace(self.still, x=x, shift_x=right, shift_y=down)

    @cached_property
    def stands_still(self) -> bool:
        """Whether all frames have one viewpoint."""
        return not any(np.ptp(v) for v in (self.x, self.shift_x, self.shift_y))

    def rate(self, frame: int) -> tuple[float, tuple[float, float]]:
        """Travel [metres/frame] and the picture's shift [pixels/frame] around a frame."""
        last = len(self.x) - 1
        around = [max(frame - 1, 0), min(frame + 1, last)]
        travel, right, down = (
            float(a[around[1]] - a[around[0]]) / (around[1] - around[0])
            for a in (self.x, self.shift_x, self.shift_y)
        )
        return travel, (right, down)


def sample_fixed_views(random: np.random.Generator, frames: int) -> Views:
    """Camera that stands somewhat above the heads."""
    still = Viewpoint(
        focal=700.0,
        eye=random.uniform(2.9, 3.3),
        horizon=random.uniform(115, 132),
        centre=SIZE[0] / 2,
    )
    return Views.standing(still, frames)


def sample_following_views(random: np.random.Generator, course: WalkingPath) -> Views:
    """Camera in the hand of someone who walks along and keeps a walker in view, not well.

    He lags by half a second and wanders; he turns the camera slowly about, with a quick turn
    off the target and back now and then; his hand shakes and his steps are seen.
    """
    frames = len(course.x)
    still = Viewpoint(
        focal=700.0,
        eye=random.uniform(1.5, 1.65),
        horizon=random.uniform(180, 200),
        centre=SIZE[0] / 2,
    )
    lag = round(random.uniform(0.4, 0.6) * FRAMES_PER_SECOND)
    x = quantised(_smoothed(course.x, lag) + random_wander(random, frames, SLOW, 0.3))
    turn = random_wander(random, frames, SLOW, 34) + random_wander(random, frames, QUICK, 3.5)
    time = np.arange(frames, dtype=np.float64)
    for start in np.arange(random.uniform(60, 140), frames - 40, random.uniform(150, 220)):
        rise, hold, fall = random.uniform(7, 14), random.uniform(2, 15), random.uniform(10, 25)
        off = smooth_step(time, start, start + rise)
        back = smooth_step(time, start + rise + hold, start + rise + hold + fall)
        turn += random.choice([-1, 1]) * random.uniform(40, 80) * (off - back)
    nod = random_wander(random, frames, SLOW, 9) + random_wander(random, frames, QUICK, 2.5)
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


def random_wander(
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
