"""`moreno2005/ellipse`: an ellipse that changes at random before clutter.

The paper says: "a synthetically generated sequence of an ellipse that changes randomly its
position, color and shape in a cluttered background", its colour along a path that no smooth
dynamics predict; and that it is tracked "even when the background has a similar color to the
target (observe the frame before last)". All the rest is ours: how fast all this goes, shapes and
texture of the background and how many there are, patches of the ellipse's own colour near its
way, its shading, the sensor's noise, and the light's changes, which the paper has in other
sequences.

What is judged has `steps=independent`: a shape that changes randomly is a new step in every frame,
of about what the tracker's dynamics were found to have, and a frame before last is one meeting of
few. In the first design, which the default still gives, rates of the shape persist, so that axes
grow for frames on end by what particles without velocity can't follow, and the ellipse meets its
colour five or six times: trackers failed there at both, which is why there is another.

What is found in moderate clutter, with fewer shapes and patches beside the way instead of on it,
is post hoc.
"""

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask
from datasets.synthetic.moreno2005.ellipse.lighting import drawn_lighting
from datasets.synthetic.moreno2005.ellipse.plan import FRAMES, SIZE, drawn_plan
from datasets.synthetic.moreno2005.ellipse.setting import drawn_patches, painted, touched
from datasets.synthetic.moreno2005.knobs import Clutter, EllipseKnobs, Steps
from datasets.synthetic.render.camera import Camera
from datasets.synthetic.scene import Scene, Truth, part_generator

__all__ = ["EllipseScene", "scene"]

Array = NDArray[np.float64]

CAMERA = Camera(SIZE, noise=5.0, fall=(0, 0))
# Brightness of the ellipse where no light falls on it straight, and what straight light adds.
SHADING = 0.78, 0.34
SLANT = 0.9  # of the light that falls on it: angle from the line of sight [radians]


def scene(knobs: EllipseKnobs) -> "EllipseScene":
    """Renderer and truth; nothing is drawn yet."""
    return EllipseScene(knobs)


class EllipseScene(Scene):
    """An ellipse before clutter; scenes that differ in their light alone share all the rest."""

    length, size = FRAMES, SIZE

    def __init__(self, knobs: EllipseKnobs) -> None:
        self._seed = knobs.scene
        self.plan = drawn_plan(knobs.scene, knobs.steps)
        self.clutter = knobs.clutter
        self.steps = knobs.steps
        self.patches = drawn_patches(knobs.scene, self.plan, knobs.clutter, knobs.steps)
        self.lighting = drawn_lighting(knobs.scene, knobs.light)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Attributes are `similar patch` (a patch of about the ellipse's present colour touches it)
        and `light change` (the light is another than in the frame before; where a shadow
        passes: its edge lies on the ellipse).
        """
        return Truth(
            self.plan.boxes,
            np.ones(FRAMES),
            {
                "similar patch": touched(self.patches, self.plan),
                "light change": self.lighting.changes(self.plan),
            },
        )

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        canvas = self._backdrop.copy()
        self._lay_ellipse(canvas, frame)
        gains = self.lighting.at(frame)[..., ::-1].astype(np.float32)
        lit = np.minimum(canvas * gains + np.float32(0.5), np.float32(255))
        canvas = np.asarray(lit, np.uint8)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        return self.plan.covers(frame)

    def _lay_ellipse(self, canvas: Image, frame: int) -> None:
        """Lay the ellipse over a canvas, which is changed in place."""
        window, inwards = self.plan.around(frame)
        square = (inwards * inwards).sum(axis=2)
        # From the outline, measured along the steepest way: exact to first order.
        slope = 2 * np.linalg.norm(inwards / self.plan.half_axes[frame], axis=2)
        coverage = np.clip(0.5 + (1 - square) / np.maximum(slope, 1e-9), 0, 1)[..., None]
        rise = np.sqrt(np.maximum(1 - square, 0))
        turned = self._light_angle - self.plan.angle[frame]
        along = inwards @ np.array([np.cos(turned), np.sin(turned)])
        straight = np.maximum(np.cos(SLANT) * rise + np.sin(SLANT) * along, 0)
        shading = (SHADING[0] + SHADING[1] * straight)[..., None]
        colour = 255 * np.minimum(self.plan.colour[frame, ::-1] * shading, 1)
        under = canvas[window]
        canvas[window] = np.round(under + coverage * (colour - under)).astype(np.uint8)

    @cached_property
    def _backdrop(self) -> Image:
        return _backdrop(self._seed, self.clutter, self.steps)

    @cached_property
    def _light_angle(self) -> float:
        random = part_generator(self._seed, "moreno2005/ellipse shading")
        return float(random.uniform(0, 2 * np.pi))


@lru_cache(maxsize=4)
def _backdrop(seed: int, density: Clutter, steps: Steps) -> Image:
    plan = drawn_plan(seed, steps)
    return painted(seed, drawn_patches(seed, plan, density, steps), density)
