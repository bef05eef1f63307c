"""`moreno2005/leaf`: a leaf in the wind in front of many similar leaves; a cloud hides the sun.

The paper: a moving leaf; highly cluttered; "the illumination changes abruptly and the target moves
unpredictably"; the change is between the first and the second of the frames shown. All other
properties are our choice: the change is a cloud that leaves dim and bluish light, and a gust moves
the leaf in the same frame. Without the displacement the jump would not defeat a contour whose
colours are refitted in every frame: one frame later they are fitted in the new light.
"""

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.moreno2005.knobs import LeafKnobs
from trackmark.datasets.synthetic.moreno2005.leaf.plan import FRAMES, JUMP, SIZE
from trackmark.datasets.synthetic.moreno2005.leaf.setting import CLOUD, MARGIN, SUNSHINE, Setting
from trackmark.datasets.synthetic.render.camera import Camera, developed
from trackmark.datasets.synthetic.render.lamp import light_left
from trackmark.datasets.synthetic.render.triangles import box_around, lay
from trackmark.datasets.synthetic.scene import Scene, Truth

Floats = NDArray[np.float32]

# Of the leaf's shadow in the sun: how far it lies from it [pixels]; see `light_left`.
OFF, SOFTNESS, DARKNESS = 26.0, 5.0, (0.02, 0.6)  # under cloud, in sunshine
CAMERA = Camera(SIZE, noise=2.2, fall=(0.05, 0.05))


def scene(knobs: LeafKnobs) -> "LeafScene":
    """Renderer and truth; nothing is drawn yet."""
    return LeafScene(knobs.scene)


class LeafScene(Scene):
    """A leaf in front of other leaves."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.setting = _setting(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the whole leaf with its stalk; nothing hides it. The attribute is
        `light change`: the first frame in other light.
        """
        boxes = np.stack([box_around(self.setting.points(frame)[0]) for frame in range(FRAMES)])
        change = np.arange(FRAMES) == JUMP
        return Truth(boxes, np.ones(FRAMES), {"light change": change})

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        light = self.setting.light(frame)
        still, swaying = self._foliage[light is SUNSHINE]
        shift = self.setting.sway[frame] - MARGIN
        moved = cv2.warpAffine(swaying, np.column_stack([np.eye(2), shift]), SIZE)
        picture = still.copy()
        lay(picture, np.asarray(moved, np.float32))
        leaf = self.setting.seen(frame)
        off = -OFF * self.setting.sun[:2] / self.setting.sun[2]
        left = light_left(leaf.coverage(SIZE), off, SOFTNESS, DARKNESS[light is SUNSHINE])
        picture = np.asarray(cv2.multiply(picture, left), np.float32)
        lay(picture[leaf.window], leaf.sheet)
        return CAMERA.exposed(developed(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        return np.asarray(self.setting.seen(frame).coverage(SIZE) >= 0.5)

    @cached_property
    def _foliage(self) -> tuple[tuple[Floats, Floats], ...]:
        """Picture of the still foliage and sheet of the swaying one: under cloud, in sunshine."""
        still, swaying = self.setting.layers
        inner = (slice(MARGIN, -MARGIN),) * 2
        return tuple(
            (np.ascontiguousarray(still.lit(light)[inner][..., :3]), swaying.lit(light))
            for light in (CLOUD, SUNSHINE)
        )


@lru_cache(maxsize=4)
def _setting(seed: int) -> Setting:
    return Setting(seed)
