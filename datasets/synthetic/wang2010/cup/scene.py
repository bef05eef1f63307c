"""`wang2010/cup`: a hand carries a cup past things of nearly its colour.

The paper says: an own recording, 80 frames of 108 x 85, a cup. At frame 36 the target is
disturbed by surroundings of almost its colour and partly hidden by something of almost its
colour; colour can't be relied upon there, while the motion stays good. All the rest is ours.

When what happens where: the cup's way, and where the things of its colour stand on it.

The paper's frame 36 is `EVENT` here. Before it the cup comes down towards the thing behind it
and the box before it; after it the cup rises and leaves both.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.scene import Scene, Truth
from trackmark.datasets.synthetic.wang2010.cup.setting import FRAMES, SIZE, WALL, Setting

Array = NDArray[np.float64]

EXPOSURE = 0.5  # part of the time between two frames for which the shutter is open
CAMERA = Camera(SIZE, noise=2.2)

# How much light the shadow on the wall takes, and its softness [pixels].
SHADOW, SOFTNESS = 0.3, 2.2
# Part of the cup that must be hidden, or before something of its colour, to be worth a word.
NOTICED = 0.1


def scene(knobs: SceneKnobs) -> "CupScene":
    """Renderer and truth; nothing is drawn yet."""
    return CupScene(knobs.scene)


class CupScene(Scene):
    """A cup in a hand, in a kitchen."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.setting = _setting(seed)
        self.plan = self.setting.plan

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the cup with its handle. Attributes are `occluded` (the box before
        it hides a tenth of the cup or more) and `similar background` (a tenth or more of it is
        before the thing of nearly its colour).
        """
        return _truth(self._seed)

    def render(self, frame: int) -> Image:
        behind, box = self.setting.still
        instants = frame + EXPOSURE * np.array([-0.25, 0.25])
        carried = np.mean([self.setting.carried.at(*self._pose(t)) for t in instants], axis=0)
        picture = behind * (1 - self._shadow(carried[..., 3]))[..., None]
        for layer in (carried, box):
            picture = picture * (1 - layer[..., 3:]) + layer[..., :3]
        canvas = np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
        if self.plan.mirrored:
            canvas = np.ascontiguousarray(canvas[:, ::-1])
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        mask = self.seen(frame)[1] >= 0.5
        return np.asarray(mask[:, ::-1] if self.plan.mirrored else mask)

    def seen(self, frame: int) -> tuple[Array, Array]:
        """Part of each pixel that the cup covers, and part that shows it; not mirrored."""
        whole, held = (layer.at(*self._pose(frame)) for layer in self.setting.silhouettes)
        return whole, held * (1 - self.setting.hidden)

    def _pose(self, time: float) -> tuple[Array, float]:
        return self.plan.middle(time), float(self.plan.tilt(time))

    def _shadow(self, coverage: Array) -> Array:
        """Light that what is carried takes from the wall."""
        x, y, z = self.plan.view.light
        shift = WALL * x / z, float(self.plan.view.row(WALL * y / z, WALL))
        matrix = np.column_stack([np.eye(2), shift])
        thrown = cv2.warpAffine(coverage, matrix, SIZE)
        return np.asarray(SHADOW * cv2.GaussianBlur(thrown, (0, 0), SOFTNESS))


_setting = lru_cache(maxsize=4)(Setting)


@lru_cache(maxsize=4)
def _truth(seed: int) -> Truth:
    scene = CupScene(seed)
    setting, plan = scene.setting, scene.plan
    times = np.arange(FRAMES)
    boxes = setting.silhouettes[0].extents(plan.middle(times), plan.tilt(times))
    if plan.mirrored:
        boxes[:, 0] = SIZE[0] - boxes[:, 0] - boxes[:, 2]
    shares = np.empty((FRAMES, 3))
    for frame in range(FRAMES):
        whole, seen = scene.seen(frame)
        parts = seen, whole * setting.hidden, whole * setting.similar
        shares[frame] = [part.sum() / whole.sum() for part in parts]
    return Truth(
        boxes,
        shares[:, 0],
        {"occluded": shares[:, 1] >= NOTICED, "similar background": shares[:, 2] >= NOTICED},
    )
