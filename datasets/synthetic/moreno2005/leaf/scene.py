"""`moreno2005/leaf`: a leaf in the wind before many like it, while the sun comes or goes.

The paper says: a moving leaf; highly cluttered; the illumination changes abruptly, between the
first and the second of the frames that it shows; the target moves unpredictably. All the rest is
ours: what leaf, that the others are of nearly its colour, that it is the sun that changes, whether
it comes or goes, that what is in the shade hardly notices it.

The paper's jump defeats a contour whose colours are refitted to every frame; no jump of ours can.
In the frame of the jump such colours tell next to nothing: by mixtures of the frame before, mean
posteriors inside the leaf and around it differ by 0.05 (median of eight scenes, of -0.1 to 0.5).
But whatever the light has become, it is the new light to which the next frame's colours are
fitted: from a mask that stayed where the leaf was they differ by 0.7 (0.5 to 0.9), from one that
lies 12 pixels off, three deviations of a contour's hypotheses, by 0.6, by 0.1 at worst. What loses
the leaf is its way in that one frame, which the method's contour would have to bridge just so.
"""

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask
from datasets.synthetic.moreno2005.knobs import LeafKnobs
from datasets.synthetic.moreno2005.leaf.plan import FRAMES, SIZE
from datasets.synthetic.moreno2005.leaf.setting import BEHIND_CLOUD, MARGIN, Setting
from datasets.synthetic.render.camera import Camera, developed
from datasets.synthetic.render.lamp import light_left
from datasets.synthetic.render.triangles import box_around, lay
from datasets.synthetic.scene import Scene, Truth

__all__ = ["LeafScene", "scene"]

Floats = NDArray[np.float32]

JUMPS = {"start": 1, "middle": FRAMES // 2, "none": FRAMES}  # first frame in other light
# Of the leaf's shadow in the sun: how far it lies from it [pixels]; see `light_left`.
OFF, SOFTNESS, DARKNESS = 26.0, 5.0, 0.6
CAMERA = Camera(SIZE, noise=2.2, fall=(0.05, 0.05))


def scene(knobs: LeafKnobs) -> "LeafScene":
    """Renderer and truth; nothing is drawn yet."""
    return LeafScene(knobs.scene, JUMPS[knobs.jump])


class LeafScene(Scene):
    """A leaf before others; `jump` is the first frame in other light, if there is any."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int, jump: int) -> None:
        self._seed = seed
        self._jump = jump
        self.setting = _setting(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the whole leaf with its stalk; nothing hides it. The attribute is
        `light change`: the first frame in other light.
        """
        boxes = np.stack([box_around(self.setting.points(frame)[0]) for frame in range(FRAMES)])
        change = np.arange(FRAMES) == self._jump
        return Truth(boxes, np.ones(FRAMES), {"light change": change})

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        sun = self._sun(frame)
        still, swaying = self._foliage[sun]
        shift = self.setting.sway[frame] - MARGIN
        moved = cv2.warpAffine(swaying, np.column_stack([np.eye(2), shift]), SIZE)
        picture = still.copy()
        lay(picture, np.asarray(moved, np.float32))
        leaf = self.setting.seen(frame, sun)
        off = -OFF * self.setting.sun[:2] / self.setting.sun[2]
        left = light_left(leaf.coverage(SIZE), off, SOFTNESS, DARKNESS * sun)
        picture = np.asarray(cv2.multiply(picture, left), np.float32)
        lay(picture[leaf.window], leaf.sheet)
        return CAMERA.exposed(developed(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        return np.asarray(self.setting.seen(frame, 0.0).coverage(SIZE) >= 0.5)

    def _sun(self, frame: int) -> float:
        """What of the sun is not behind a cloud."""
        return 1.0 if self.setting.sunny == (frame < self._jump) else BEHIND_CLOUD

    @cached_property
    def _foliage(self) -> dict[float, tuple[Floats, Floats]]:
        """By what of the sun is seen: picture of what is still, sheet of what sways before it."""
        still, swaying = self.setting.layers
        inner = (slice(MARGIN, -MARGIN),) * 2
        return {
            sun: (np.ascontiguousarray(still.lit(sun)[inner][..., :3]), swaying.lit(sun))
            for sun in (1.0, BEHIND_CLOUD)
        }


@lru_cache(maxsize=4)
def _setting(seed: int) -> Setting:
    return Setting(seed)
