"""Driving scenes: paths of cars, camera, renderer and ground truth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.nummiaro2003.driving.car import Car, CarAt
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    OVERCAST,
    Drawable,
    Light,
    PerspectiveView,
    Window,
    sort_from_far,
    windows_meet,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.world import Layout, World
from trackmark.datasets.synthetic.render.attributes import occluded, out_of_view, rescaled, turning
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.prop import Coverage, visible_part
from trackmark.datasets.synthetic.render.sprite import instants
from trackmark.datasets.synthetic.scene import (
    SceneTruth,
    SyntheticScene,
    part_generator,
    paste_window,
)

_STEP = 0.05  # sampling step along a route [metres]
_EASE = 3.0  # distance over which the steering angle changes [metres]

SIDEWAYS = 2.2  # maximum lateral acceleration [metres/second²]
BRAKING = 1.6  # maximum longitudinal acceleration [metres/second²]


@dataclass(frozen=True)
class Bend:
    """Straight section followed by a bend."""

    straight: float  # length up to the bend [metres]
    turn: float = 0.0  # angle of the bend, positive to the right [radians]
    radius: float = 1.0  # [metres]


class Route:
    """Smooth curve on the ground that starts at (x, z) [metres] in a heading [radians]."""

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

    def places_at(self, travelled: Array) -> Array:
        """Return x, z and heading after the distances `travelled` [metres], shape (n, 3)."""
        grid = np.arange(len(self._track)) * _STEP
        return np.stack([np.interp(travelled, grid, line) for line in self._track.T], axis=1)

    def travelled(self, frames: int, top: float, end: float) -> Array:
        """Return the distance from the start in every frame [metres], shape (frames,).

        The car drives the whole route within `frames`: one factor scales all speeds. Before
        scaling, `top` is the speed on straight sections and `end` the final speed [metres/second].
        """
        times, grid = self._schedule(top, end)
        wanted = np.arange(frames) / (frames - 1) * times[-1]
        return np.asarray(np.interp(wanted, times, grid))

    def driven(self, frames: int, start: float, top: float) -> Array:
        """Return the distance from the start in every frame [metres], shape (frames,).

        `start` is this distance in the first frame. `top` is the speed on straight sections
        [metres/second]; the speeds are not scaled.
        """
        times, grid = self._schedule(top, top)
        start_time = np.interp(start, grid, times)
        return np.asarray(
            np.interp(start_time + np.arange(frames) / FRAMES_PER_SECOND, times, grid)
        )

    def _schedule(self, top: float, end: float) -> tuple[Array, Array]:
        """Return times [seconds] and the distances from the start at these times [metres]."""
        bends = np.sqrt(SIDEWAYS / np.maximum(np.abs(self._curvature), 1e-6))
        speed = limit_acceleration(np.minimum(top, bends), end)
        middle = (speed[1:] + speed[:-1]) / 2
        times = np.concatenate([[0.0], np.cumsum(_STEP / middle)])
        return times, np.asarray(np.arange(len(times)) * _STEP, np.float64)


def limit_acceleration(fastest: Array, end: float) -> Array:
    """Reduce the speeds `fastest` along a route so that no acceleration exceeds BRAKING.

    `end` is the maximum speed at the end of the route [metres/second].
    """
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
    """Position of the centre of a car on the ground, and its heading, in every frame."""

    x: Array  # (n,), to the right [metres]
    z: Array  # (n,), ahead [metres]
    heading: Array  # (n,), [radians]

    @classmethod
    def in_heading(cls, frames: int, x: ArrayLike, z: ArrayLike, heading: float) -> Self:
        """Return a path with a constant heading; `x` and `z` may also be constant."""
        columns = (np.asarray(v, np.float64) for v in (x, z, heading))
        return cls(*(np.broadcast_to(column, frames) for column in columns))


SIZE = 640, 480  # width and height of the images [pixels]
FRAMES_PER_SECOND = 25.0

EXPOSURE = 0.4  # fraction of the frame time for which the shutter is open


@dataclass(frozen=True)
class DrivingPlan:
    """Surroundings, cars and camera of a scene."""

    layout: Layout  # surroundings
    views: Sequence[PerspectiveView]  # camera in every frame
    cars: Sequence[tuple[Car, DrivingPath]]  # moving cars; the first is the target

    def __len__(self) -> int:
        return len(self.views)

    @cached_property
    def boxes(self) -> Array:
        """Boxes of the whole target in every frame, shape (n, 4) [pixels]."""
        return np.stack([self.car(0, k).box(view) for k, view in enumerate(self.views)])

    @cached_property
    def viewing_angles(self) -> Array:
        """Angles between the target's heading and the line of sight, shape (n,) [radians].

        An angle of 0 shows the rear and one of ±π/2 shows a side. Angles are continuous over time.
        """
        path = self.cars[0][1]
        places = np.array([view.place for view in self.views])
        sight = np.unwrap(np.arctan2(path.x - places[:, 0], path.z - places[:, 2]))
        return np.asarray(path.heading - sight)

    def car(self, number: int, frame: int) -> CarAt:
        """Return the car `cars[number]` at its position in a frame."""
        car, path = self.cars[number]
        return car_at(car, path, frame, self.layout.light)

    def moving(self, number: int, frame: int) -> CarAt:
        """Return the car `cars[number]` with its motion blur, for a static camera."""
        around = max(frame - 1, 0), min(frame + 1, len(self) - 1)
        current = self.car(number, frame)
        last, following = (self.car(number, k).box(self.views[k]) for k in around)
        step = (following - last)[:2] + (following - last)[2:] / 2
        motion = step * (EXPOSURE / (around[1] - around[0]))
        moments = instants(float(np.abs(motion).max()))
        right, down = motion.tolist()
        return replace(current, motion=(right, down), moments=tuple(moments.tolist()))

    def seen(self, frame: int) -> Coverage:
        """Return the visible part of the target's silhouette."""
        view = self.views[frame]
        hiding = (car.coverage(view, SIZE) for car in self._hiding(frame))
        return visible_part(self.car(0, frame).coverage(view, SIZE), hiding)

    @cached_property
    def visibility(self) -> Array:
        """Visible fraction of the target in every frame, shape (n,)."""
        fractions = np.ones(len(self))
        for frame, (x, y, width, height) in enumerate(self.boxes.tolist()):
            inside = x >= 0 and y >= 0 and x + width <= SIZE[0] and y + height <= SIZE[1]
            if inside and not self._hiding(frame):
                continue
            # The whole silhouette, in an image that is large enough for it.
            view = self.views[frame].shifted(math.floor(-x), math.floor(-y))
            size = math.ceil(width) + 2, math.ceil(height) + 2
            whole = self.car(0, frame).coverage(view, size)[2]
            fractions[frame] = self.seen(frame)[2].sum() / whole.sum()
        return fractions

    def _hiding(self, frame: int) -> list[CarAt]:
        """Return the cars in front of the target whose windows overlap its window."""
        view, target = self.views[frame], self.car(0, frame)
        driving = [self.car(number, frame) for number in range(1, len(self.cars))]
        squared_distance = _squared_distance(view, target)
        window = target.window(view)
        nearer_cars = [
            car
            for car in (*driving, *self.layout.parked)
            if _squared_distance(view, car) < squared_distance
        ]
        windows = [car.window(view) for car in nearer_cars]
        return [
            car
            for car, nearer_window in zip(nearer_cars, windows, strict=True)
            if window is not None
            and nearer_window is not None
            and windows_meet(window, nearer_window)
        ]


def car_at(car: Car, path: DrivingPath, frame: int, light: Light = OVERCAST) -> CarAt:
    """Return a car at its position in a frame."""
    x, z, heading = (float(a[frame]) for a in (path.x, path.z, path.heading))
    return CarAt(car, x, z, heading, light)


def _squared_distance(view: PerspectiveView, car: CarAt) -> float:
    """Return the squared horizontal distance of a car from the camera [metres²]."""
    x, z = car.x - view.place[0], car.z - view.place[2]
    return x * x + z * z


# minimum change of the viewing angle in a second for the attribute `turning` [degrees]
TURNING = 15.0
FASTEST = 0.2  # fraction of the frames that have the attribute `fast`


def driving_truth(plan: DrivingPlan) -> SceneTruth:
    """Return the ground truth of all frames.

    `boxes` are the extents of the whole car. The attributes are:

    - `occlusion`: less than 0.9 of the target is visible.
    - `out_of_view`: a part of the box is outside the image.
    - `scale_change`: the width is outside 0.8 to 1.25 times the first width.
    - `turning`: the viewing angle of the car changes by more than 15 degrees per second.
    - `fast`: the image motion is among the largest fifth.
    """
    boxes, visibility = plan.boxes, plan.visibility
    steps = np.gradient(boxes[:, :2] + boxes[:, 2:] / 2, axis=0)
    speed = np.sqrt((steps * steps).sum(axis=1))
    return SceneTruth(
        boxes,
        visibility,
        {
            "occlusion": occluded(visibility),
            "out_of_view": out_of_view(boxes),
            "scale_change": rescaled(boxes[:, 2]),
            "turning": turning(plan.viewing_angles, TURNING),
            "fast": np.greater(speed, np.quantile(speed, 1 - FASTEST)),
        },
    )


CAMERA = Camera(SIZE, noise=2.0)


class DrivingScene(SyntheticScene):
    """Scene of driving cars; if the camera is `still`, static objects are drawn only once."""

    size = SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, plan: DrivingPlan, still: bool) -> None:
        self.plan, self.length = plan, len(plan)
        self._is_still = still

    def truth(self) -> SceneTruth:
        return driving_truth(self.plan)

    def render(self, frame: int) -> Image:
        canvas = self._with_moving(frame) if self._is_still else self._painted(frame)
        return CAMERA.exposed(canvas, self.plan.layout.seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        return paste_window(SIZE, *self.plan.seen(frame)) >= 128

    def _painted(self, frame: int) -> Image:
        """Render all objects for a moving camera."""
        view = self.plan.views[frame]
        canvas = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
        self._world.draw(canvas, view)
        cars = [self.plan.car(number, frame) for number in range(len(self.plan.cars))]
        for thing in sort_from_far([*self._world.resting, *cars], view, SIZE[0]):
            thing.draw(canvas, view)
        return canvas

    def _with_moving(self, frame: int) -> Image:
        """Render a static scene for a still camera; redraw only around moving cars."""
        view = self.plan.views[frame]
        empty, full, resting = self._at_rest
        canvas = full.copy()
        moving = [self.plan.moving(number, frame) for number in range(len(self.plan.cars))]
        windows = [(car.window(view), car) for car in moving]
        for window, _ in windows:
            if window is None:
                continue
            left, top = max(window[0], 0), max(window[1], 0)
            right, bottom = min(window[2], SIZE[0]), min(window[3], SIZE[1])
            if left >= right or top >= bottom:
                continue
            part = empty[top:bottom, left:right].copy()
            near = [
                thing
                for other, thing in [*resting, *windows]
                if other and windows_meet(window, other)
            ]
            shifted = view.shifted(-left, -top)
            for thing in sort_from_far(near, view, SIZE[0]):
                thing.draw(part, shifted)
            canvas[top:bottom, left:right] = part
        return canvas

    @cached_property
    def _at_rest(self) -> tuple[Image, Image, list[tuple[Window | None, Drawable]]]:
        """Images without and with static objects, and the static objects with their windows."""
        view = self.plan.views[0]
        empty = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
        self._world.draw(empty, view)
        full = empty.copy()
        for thing in sort_from_far(self._world.resting, view, SIZE[0]):
            thing.draw(full, view)
        return empty, full, [(thing.window(view), thing) for thing in self._world.resting]

    @cached_property
    def _world(self) -> World:
        yaws = [view.yaw for view in self.plan.views]
        focal = self.plan.views[0].focal
        return World(self.plan.layout, focal, (min(yaws), max(yaws)))

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self.plan.layout.seed, "exposure")
        return slow_exposure(random, len(self))
