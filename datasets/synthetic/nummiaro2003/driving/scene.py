"""Renderer and ground truth of the driving scenes."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.nummiaro2003.driving.plan import (
    FRAMES_PER_SECOND,
    SIZE,
    DrivingPlan,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    Drawable,
    Window,
    sort_from_far,
    windows_meet,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.world import World
from trackmark.datasets.synthetic.render.attributes import occluded, out_of_view, rescaled, turning
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.scene import (
    SceneTruth,
    SyntheticScene,
    part_generator,
    paste_window,
)

Array = NDArray[np.float64]

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
    course = plan.cars[0][1]
    places = np.array([view.place for view in plan.views])
    sight = np.unwrap(np.arctan2(course.x - places[:, 0], course.z - places[:, 2]))
    steps = np.gradient(boxes[:, :2] + boxes[:, 2:] / 2, axis=0)
    speed = np.sqrt((steps * steps).sum(axis=1))
    return SceneTruth(
        boxes,
        visibility,
        {
            "occlusion": occluded(visibility),
            "out_of_view": out_of_view(boxes),
            "scale_change": rescaled(boxes[:, 2]),
            "turning": turning(course.heading - sight, TURNING),
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
        """Images without and with the static objects, and these objects with their windows."""
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
