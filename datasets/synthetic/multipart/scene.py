"""Renderer of the walking scenes."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask
from datasets.synthetic.multipart.plan import Plan
from datasets.synthetic.multipart.truth import walking_truth
from datasets.synthetic.render.camera import Camera, slow_exposure
from datasets.synthetic.render.pinhole import FRAMES_PER_SECOND, SIZE
from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.shade import Light
from datasets.synthetic.render.street.street import Street
from datasets.synthetic.scene import Scene, Truth, part_generator, pasted

__all__ = ["WalkingScene"]

Array = NDArray[np.float64]

EXPOSURE = 0.4
"""Part of the time between two frames for which the shutter is open."""

CAMERA = Camera(SIZE, noise=2.0)

LIT = np.linspace(1.0, 0.0, 16)
"""Heights over stature at which the light on a person is asked for."""

SHADE = 0.85
"""Mean light below which the target counts as in the shade."""


class WalkingScene(Scene):
    """People in a street, one of them the target.

    Parameters
    ----------
    plan : Plan
        Who walks where, and what the camera does.
    kind : {'even', 'dappled'}
        Of the light.
    """

    size = SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, plan: Plan, kind: Light) -> None:
        self.plan, self.length = plan, len(plan)
        self._kind = kind

    def truth(self) -> Truth:
        """See `Scene.truth`."""
        shade = np.array([self._gains(0, frame).mean() < SHADE for frame in range(len(self))])
        return walking_truth(self.plan, shade)

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        plan, camera = self.plan, self.plan.views[frame]
        travel, (right, down) = plan.views.rate(frame)
        canvas = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
        motion = right * EXPOSURE, down * EXPOSURE
        self._street.draw(canvas, camera, motion, travel * EXPOSURE)
        props = [*self._street.props, *plan.posts]
        things: list[tuple[float, Prop | int]] = [(prop.z, prop) for prop in props]
        things += [(plan.depth(person, frame), person) for person in plan.in_picture(frame)]
        for _, thing in sorted(things, key=lambda item: -item[0]):
            if isinstance(thing, int):
                self._draw_person(canvas, thing, frame)
            else:
                thing.draw(canvas, camera, motion[0], travel * EXPOSURE)
        return CAMERA.exposed(canvas, plan.seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        return pasted(SIZE, *self.plan.seen(frame)) >= 128

    def _draw_person(self, canvas: Image, person: int, frame: int) -> None:
        plan = self.plan
        x, y, height = plan.places[person, frame].tolist()
        motion = plan.motion(person, frame) * EXPOSURE
        plan.walkers[person].draw(
            canvas,
            x,
            y,
            height,
            plan.pose(person, frame),
            self._gains(person, frame),
            (float(motion[0]), float(motion[1])),
        )

    def _gains(self, person: int, frame: int) -> Array:
        """Light on a person from head to ground."""
        who = self.plan.people[person]
        x, z = float(who.course.x[frame]), float(who.course.z[frame])
        return self._street.gains(x, z, LIT * who.stature)

    @cached_property
    def _street(self) -> Street:
        return self.plan.street(self._kind)

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self.plan.seed, "exposure")
        return slow_exposure(random, len(self))
