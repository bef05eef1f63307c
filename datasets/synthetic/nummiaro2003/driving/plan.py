"""All that is decided of a scene with cars before anything is drawn: ways, camera, place."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.car import Car, CarAt
from trackmark.datasets.synthetic.nummiaro2003.driving.view import PerspectiveView, meet
from trackmark.datasets.synthetic.nummiaro2003.driving.world import Layout
from trackmark.datasets.synthetic.render.prop import Coverage, visible
from trackmark.datasets.synthetic.render.sprite import instants

Array = NDArray[np.float64]

_STEP = 0.05  # along a way [metres]
_EASE = 3.0  # way in which the steering wheel is turned [metres]

SIDEWAYS = 2.2  # acceleration in bends that drivers take [metres/second²]
BRAKING = 1.6  # acceleration along the way that they take [metres/second²]


@dataclass(frozen=True)
class Bend:
    """A stretch straight on, and the bend after it."""

    straight: float  # up to the bend [metres]
    turn: float = 0.0  # by how much it turns, to the right positive [radians]
    radius: float = 1.0  # [metres]


class Way:
    """A curve over the ground from a place [metres] in a heading [radians], with smooth bends."""

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
        """Way driven by every frame [metres], shape (frames,), if they are to drive it all.

        `top` is the speed straight on, against that in bends, `end` the speed at the end
        [metres/second]: as a driver has them, all times the factor that makes the times meet.
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
        """Way driven by every frame [metres], shape (frames,), at an ordinary driver's speeds.

        `start` is the place in the first frame [metres from the way's beginning], `top` the speed
        straight on [metres/second].
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
class DrivingPath:
    """Where a car is in every frame."""

    # x, z: (n,), its middle on the ground [metres]
    x: Array
    z: Array
    heading: Array  # (n,), [radians]

    @classmethod
    def of(cls, frames: int, x: ArrayLike, z: ArrayLike, heading: float) -> Self:
        """Course of some frames in one heading; a place that is one number stays the same."""
        columns = (np.asarray(v, np.float64) for v in (x, z, heading))
        return cls(*(np.broadcast_to(column, frames) for column in columns))


SIZE = 640, 480  # width and height of the images [pixels]
FRAMES_PER_SECOND = 25.0

EXPOSURE = 0.4  # part of the time between two frames for which the shutter is open


@dataclass(frozen=True)
class DrivingPlan:
    """Cars and camera of a scene."""

    layout: Layout  # the place
    views: Sequence[PerspectiveView]  # the camera in every frame
    cars: Sequence[tuple[Car, DrivingPath]]  # what drives; the target first

    def __len__(self) -> int:
        return len(self.views)

    @cached_property
    def boxes(self) -> Array:
        """Extents of the whole target in every frame, shape (n, 4) [pixels]."""
        return np.stack([self.car(0, k).box(view) for k, view in enumerate(self.views)])

    def car(self, number: int, frame: int) -> CarAt:
        """A car where it is in a frame, numbered as `cars`."""
        car, course = self.cars[number]
        return car_at(car, course, frame)

    def moving(self, number: int, frame: int) -> CarAt:
        """As `car`, blurred by its motion before a camera that stands."""
        around = max(frame - 1, 0), min(frame + 1, len(self) - 1)
        here = self.car(number, frame)
        last, following = (self.car(number, k).box(self.views[k]) for k in around)
        step = (following - last)[:2] + (following - last)[2:] / 2
        motion = step * (EXPOSURE / (around[1] - around[0]))
        moments = instants(float(np.abs(motion).max()))
        right, down = motion.tolist()
        return replace(here, motion=(right, down), moments=tuple(moments.tolist()))

    def seen(self, frame: int) -> Coverage:
        """Silhouette of the target where it is in the picture and behind nothing."""
        view = self.views[frame]
        hiding = (car.coverage(view, SIZE) for car in self._hiding(frame))
        return visible(self.car(0, frame).coverage(view, SIZE), hiding)

    @cached_property
    def visibility(self) -> Array:
        """Fraction of the target that is seen, in every frame."""
        fractions = np.ones(len(self))
        for frame, (x, y, width, height) in enumerate(self.boxes.tolist()):
            inside = x >= 0 and y >= 0 and x + width <= SIZE[0] and y + height <= SIZE[1]
            if inside and not self._hiding(frame):
                continue
            # The whole of it, in a picture that holds it.
            view = self.views[frame].shifted(math.floor(-x), math.floor(-y))
            size = math.ceil(width) + 2, math.ceil(height) + 2
            whole = self.car(0, frame).coverage(view, size)[2]
            fractions[frame] = self.seen(frame)[2].sum() / whole.sum()
        return fractions

    def _hiding(self, frame: int) -> list[CarAt]:
        """Cars before the target whose windows meet its."""
        view, target = self.views[frame], self.car(0, frame)
        driving = [self.car(number, frame) for number in range(1, len(self.cars))]
        far = _apart(view, target)
        window = target.window(view)
        others = [car for car in (*driving, *self.layout.parked) if _apart(view, car) < far]
        windows = [car.window(view) for car in others]
        return [
            car
            for car, other in zip(others, windows, strict=True)
            if window is not None and other is not None and meet(window, other)
        ]


def car_at(car: Car, course: DrivingPath, frame: int) -> CarAt:
    """A car where its course has it in a frame."""
    x, z, heading = (float(a[frame]) for a in (course.x, course.z, course.heading))
    return CarAt(car, x, z, heading)


def _apart(view: PerspectiveView, car: CarAt) -> float:
    """Square of the distance from the camera over the ground."""
    x, z = car.x - view.place[0], car.z - view.place[2]
    return x * x + z * z
