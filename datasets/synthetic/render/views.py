"""Street cameras, which are static or follow a person, and walking paths.

World coordinates are x to the right, height above the ground, and z away from the camera [metres].
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.path import quantised, smooth_step

SIZE = 640, 480  # width and height of the images [pixels]

FRAMES_PER_SECOND = 25.0

Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class Viewpoint:
    """Position, orientation and projection of a camera at one time."""

    focal: float  # focal length [pixels]
    eye: float  # height above the ground [metres]
    horizon: float  # row of the horizon without shift [pixels]
    centre: float  # column of the optical axis without shift [pixels]
    x: float = 0.0  # lateral position [metres]
    # shift of the whole image to the right by turning and shaking of the camera [pixels]
    shift_x: float = 0.0
    # downward shift of the whole image by turning and shaking of the camera [pixels]
    shift_y: float = 0.0

    def scale(self, z: Number) -> Number:
        """Return the scale at a depth [metres] in pixels/metre."""
        return self.focal / z

    def column(self, x: Number, z: Number) -> Number:
        """Return the image column of a lateral position x at a depth z, both in metres."""
        return self.centre + self.shift_x + (x - self.x) * self.scale(z)

    def row(self, height: Number, z: Number) -> Number:
        """Return the image row of a height above the ground at a depth z, both in metres."""
        return self.horizon + self.shift_y + (self.eye - height) * self.scale(z)


CYCLE = 1.42  # length of two steps at an ordinary pace [metres]
ORDINARY = 1.3  # speed at which steps have their maximum length [metres/second]

# A walker turns towards the next point at this distance from the current one [metres]
REACHED = 0.8

# maximum turning speed of a walker [radians/frame]
FASTEST_TURN = math.radians(130) / FRAMES_PER_SECOND


@dataclass(frozen=True)
class WalkingPath:
    """Position, heading and gait phase of a person in every frame."""

    x: Array  # (n,), position to the right [metres]
    z: Array  # (n,), position away from the camera [metres]
    heading: Array  # (n,), continuous; 0 is to the right, pi / 2 towards the camera [radians]
    phase: Array  # (n,), number of gait cycles of two steps since an arbitrary start
    stride: Array  # (n,), relative length of the steps, in [0, 1]

    @classmethod
    def through(cls, x: Array, z: Array, phase: float) -> Self:
        """Return the path with a position in every frame; `phase` is the first gait phase."""
        dx, dz = np.gradient(x), np.gradient(z)
        step = np.sqrt(dx * dx + dz * dz)
        stride = np.clip(step * FRAMES_PER_SECOND / ORDINARY, 0, 1)
        # Slow walkers make shorter and slightly fewer steps.
        cycles = step / (CYCLE * (0.35 + 0.65 * stride))
        return cls(
            x,
            z,
            quantised(np.unwrap(np.arctan2(-dz, dx))),
            quantised(phase + np.cumsum(cycles) - cycles[0]),
            quantised(stride),
        )

    def __getitem__(self, frames: slice | NDArray[np.int64]) -> Self:
        """Return the part of the path in the selected frames."""
        columns = (self.x, self.z, self.heading, self.phase, self.stride)
        return type(self)(*(column[frames] for column in columns))


def straight_path(
    frames: int, frame: int, place: tuple[float, float], velocity: tuple[float, float], phase: float
) -> WalkingPath:
    """Return a straight path that is at (x, z) [metres] in `frame`; velocity in metres/second."""
    elapsed = (np.arange(frames) - frame) / FRAMES_PER_SECOND
    x, z = (start + way * elapsed for start, way in zip(place, velocity, strict=True))
    return WalkingPath.through(x, z, phase)


def walk_through_points(
    frames: int,
    start: tuple[float, float],
    points: Iterator[tuple[float, float]],
    speed: float,
    phase: float,
) -> WalkingPath:
    """Return a path from point to point (x, z) [metres] in arcs; the walker is slower in bends.

    `start` is the position in the first frame. The walker heads for the `points` in order and turns
    towards the next point within 0.8 m of the current one. `speed` is the speed on straight lines
    [metres/second], `phase` the gait phase in the first frame [cycles].
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


SLOW = (2.5, 9.0)  # range of periods of slow deviations of a hand-held camera [seconds]
QUICK = (0.28, 1.1)  # range of periods of the shake of a hand-held camera [seconds]


@dataclass(frozen=True)
class Views:
    """Camera in every frame."""

    still: Viewpoint  # constant properties of the camera
    x: Array  # (n,), lateral position [metres]
    shift_x: Array  # (n,), shift of the image to the right by turning and shaking [pixels]
    shift_y: Array  # (n,), downward shift of the image by turning and shaking [pixels]

    @classmethod
    def standing(cls, still: Viewpoint, frames: int) -> Self:
        """Return the views of a static camera for a number of frames."""
        nothing = np.zeros(frames)
        return cls(still, nothing, nothing, nothing)

    def __getitem__(self, frame: int) -> Viewpoint:
        """Return the viewpoint in a frame."""
        x, right, down = (float(a[frame]) for a in (self.x, self.shift_x, self.shift_y))
        return replace(self.still, x=x, shift_x=right, shift_y=down)

    @cached_property
    def stands_still(self) -> bool:
        """True if all frames have one viewpoint."""
        return not any(np.ptp(v) for v in (self.x, self.shift_x, self.shift_y))

    def rate(self, frame: int) -> tuple[float, tuple[float, float]]:
        """Return the camera's travel [metres/frame] and the image shift [pixels/frame]."""
        last = len(self.x) - 1
        around = [max(frame - 1, 0), min(frame + 1, last)]
        travel, right, down = (
            float(a[around[1]] - a[around[0]]) / (around[1] - around[0])
            for a in (self.x, self.shift_x, self.shift_y)
        )
        return travel, (right, down)


def sample_fixed_views(random: Generator, frames: int) -> Views:
    """Sample a static camera slightly above the heads of people."""
    still = Viewpoint(
        focal=700.0,
        eye=random.uniform(2.9, 3.3),
        horizon=random.uniform(115, 132),
        centre=SIZE[0] / 2,
    )
    return Views.standing(still, frames)


def sample_following_views(random: Generator, path: WalkingPath) -> Views:
    """Sample a hand-held camera that follows a walker imperfectly.

    The person with the camera lags by half a second and deviates from the walker's path. The camera
    turns slowly; sometimes it turns quickly away from the target and back. Its shake and the steps
    of the person are visible.
    """
    frames = len(path.x)
    still = Viewpoint(
        focal=700.0,
        eye=random.uniform(1.5, 1.65),
        horizon=random.uniform(180, 200),
        centre=SIZE[0] / 2,
    )
    lag = round(random.uniform(0.4, 0.6) * FRAMES_PER_SECOND)
    x = quantised(_smoothed(path.x, lag) + random_wander(random, frames, SLOW, 0.3))
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
    # The turn is reduced as the target's distance grows, so that the target stays in the image.
    aim = still.column(path.x - x, path.z) - still.centre
    room = 0.30 * SIZE[0]
    shift_x = room * np.tanh((aim + turn) / room) - aim
    return Views(still, x, quantised(shift_x), quantised(nod))


def _smoothed(values: Array, lag: int) -> Array:
    """Return the weighted mean of the last 2 `lag` + 1 values, which lags by `lag` frames."""
    weights = np.hanning(2 * lag + 3)[1:-1]
    before = np.full(2 * lag, values[0])
    return np.convolve(np.concatenate([before, values]), weights / weights.sum(), "valid")


def random_wander(
    random: Generator, frames: int, periods: Sequence[float], deviation: float
) -> Array:
    """Return a sum of five waves with random periods [seconds] and a standard deviation."""
    time = np.arange(frames) / FRAMES_PER_SECOND
    low, high = (float(np.log(period)) for period in periods)
    total = np.zeros(frames)
    for _ in range(5):
        period = float(np.exp(random.uniform(low, high)))
        total += np.sin(2 * np.pi * (time / period + random.uniform()))
    return total * deviation * float(np.sqrt(2 / 5))
