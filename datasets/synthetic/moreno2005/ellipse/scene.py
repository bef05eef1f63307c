"""`moreno2005/ellipse`: an ellipse that changes at random in front of clutter.

The paper: "a synthetically generated sequence of an ellipse that changes randomly its position,
color and shape in a cluttered background"; it is tracked "even when the background has a similar
color to the target (observe the frame before last)". All other properties are our choice: shape
and colour take a new random step in every frame, the displacement stays within two deviations of
the shift that was estimated for trackers, and the ellipse meets a patch of its colour three times.
Many shapes of the background have a colour that the ellipse has at another time.
"""

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.moreno2005.ellipse.plan import FRAMES, SIZE, drawn_plan
from trackmark.datasets.synthetic.moreno2005.ellipse.setting import drawn_patches, painted, touched
from trackmark.datasets.synthetic.moreno2005.knobs import EllipseKnobs
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator

Array = NDArray[np.float64]

CAMERA = Camera(SIZE, noise=5.0, fall=(0, 0))
# Brightness of the ellipse where no light falls on it straight, and what straight light adds.
SHADING = 0.78, 0.34
SLANT = 0.9  # of the light that falls on it: angle from the line of sight [radians]


def scene(knobs: EllipseKnobs) -> "EllipseScene":
    """Renderer and truth; nothing is drawn yet."""
    return EllipseScene(knobs.scene)


class EllipseScene(Scene):
    """An ellipse in front of clutter."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = drawn_plan(seed)
        self.patches = drawn_patches(seed, self.plan)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        The attribute is `similar patch`: a patch of about the ellipse's present colour touches it.
        """
        touching = touched(self.patches, self.plan)
        return Truth(self.plan.boxes, np.ones(FRAMES), {"similar patch": touching})

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        canvas = self._backdrop.copy()
        self._lay_ellipse(canvas, frame)
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
        return _backdrop(self._seed)

    @cached_property
    def _light_angle(self) -> float:
        random = part_generator(self._seed, "moreno2005/ellipse shading")
        return float(random.uniform(0, 2 * np.pi))


@lru_cache(maxsize=4)
def _backdrop(seed: int) -> Image:
    plan = drawn_plan(seed)
    return painted(seed, plan, drawn_patches(seed, plan))
