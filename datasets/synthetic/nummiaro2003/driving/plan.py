"""All that is decided of a scene with cars before anything is drawn."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.car import Car, CarAt
from datasets.synthetic.nummiaro2003.driving.thing import meet
from datasets.synthetic.nummiaro2003.driving.view import View
from datasets.synthetic.nummiaro2003.driving.way import Course
from datasets.synthetic.nummiaro2003.driving.world import Layout
from datasets.synthetic.render.layers import instants
from datasets.synthetic.render.prop import Coverage, visible

__all__ = ["EXPOSURE", "FRAMES_PER_SECOND", "SIZE", "Plan", "car_at"]

Array = NDArray[np.float64]

SIZE = 640, 480
"""Width and height of the images [pixels]."""

FRAMES_PER_SECOND = 25.0

EXPOSURE = 0.4
"""Part of the time between two frames for which the shutter is open."""


@dataclass(frozen=True)
class Plan:
    """Cars and camera of a scene.

    Attributes
    ----------
    layout : Layout
        The place.
    views : sequence of View
        The camera in every frame.
    cars : sequence of (Car, Course)
        What drives; the target first.
    """

    layout: Layout
    views: Sequence[View]
    cars: Sequence[tuple[Car, Course]]

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


def car_at(car: Car, course: Course, frame: int) -> CarAt:
    """A car where its course has it in a frame."""
    x, z, heading = (float(a[frame]) for a in (course.x, course.z, course.heading))
    return CarAt(car, x, z, heading)


def _apart(view: View, car: CarAt) -> float:
    """Square of the distance from the camera over the ground."""
    x, z = car.x - view.place[0], car.z - view.place[2]
    return x * x + z * z
