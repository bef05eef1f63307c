"""`moreno2005/octopus`: a soft body crawls over the sea floor and imitates it.

The paper: "a real video sequence of an octopus changing its appearance while camouflaging", its
"appearance [...] quite similar to the background" at times. All other properties are our choice:
body and motion, zones of the floor, times of the changes, stones and algae, the water's moving
light, the sensor's noise. The skin takes on a part of the floor's look only, so that the colours
of each frame still separate most of the body from the floor. The arms are short, webbed and move
little, as the paper's contours change by affine maps from frame to frame.
"""

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.moreno2005.knobs import OctopusKnobs
from trackmark.datasets.synthetic.moreno2005.octopus.body import Skin
from trackmark.datasets.synthetic.moreno2005.octopus.looks import (
    FLOOR_KINDS,
    SKINS,
    imitated,
    painted,
)
from trackmark.datasets.synthetic.moreno2005.octopus.plan import FRAMES, OWN, SIZE, Plan, drawn_plan
from trackmark.datasets.synthetic.moreno2005.octopus.relief import moulded, shade
from trackmark.datasets.synthetic.moreno2005.octopus.setting import Water, painted_floor
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

CAMERA = Camera(SIZE, noise=3.0, fall=(0.06, 0.09))
MARGIN = 14  # around the octopus, for its shadow [pixels]
SHADOW = (4, 5), 3.0, 0.45  # of the octopus: where it falls, softness [pixels], and what it takes


def scene(knobs: OctopusKnobs) -> "OctopusScene":
    """Renderer and truth; nothing is drawn yet."""
    return OctopusScene(knobs.scene)


class OctopusScene(Scene):
    """An octopus on the sea floor; all that is drawn at random has its seed."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = _plan(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        The attribute is `camouflaged`: the mean colour of the octopus's present look is within
        0.2 (in RGB of [0, 1], in even light) of those of the floors around it; distances from
        several floors are averaged, each by its part of the surroundings.
        """
        plan = self.plan
        return Truth(plan.boxes, np.ones(FRAMES), {"camouflaged": plan.camouflaged})

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        picture = self._floor.copy()
        self._lay_octopus(picture, frame)
        canvas = self._water.over(picture, frame)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        balls = self.plan.posture(frame).balls
        return np.asarray(moulded(balls, (0.0, 0.0), 1.0, SIZE[::-1], ground=-1.0)[1] >= 0)

    def _lay_octopus(self, picture: Floats, frame: int) -> None:
        """Lay the octopus and its shadow over a picture, which is changed in place."""
        posture = self.plan.posture(frame)
        x, y, width, height = posture.box
        left, top = max(int(x) - MARGIN, 0), max(int(y) - MARGIN, 0)
        right = min(int(x + width) + MARGIN, SIZE[0])
        bottom = min(int(y + height) + MARGIN, SIZE[1])
        window = picture[top:bottom, left:right]
        size = right - left, bottom - top
        coloured = self._skin.seen(posture, (left, top), size, *self.plan.look(frame))
        sheet = np.asarray(cv2.resize(coloured, size, interpolation=cv2.INTER_AREA), np.float32)
        shade(window, sheet[..., 3], *SHADOW)
        window *= 1 - sheet[..., 3:]
        window += sheet[..., :3]

    @cached_property
    def _skin(self) -> Skin:
        random, plan = self._random("skin"), self.plan
        own = painted(random, SKINS[plan.kinds[OWN]], plan.colours[OWN])
        # Turned round, so that nothing of a floor lies on the same thing on the skin.
        looks = [imitated(np.rot90(texture), own) for texture in self._textures]
        return Skin(random, plan.body, [*looks, own])

    @cached_property
    def _floor(self) -> Floats:
        return painted_floor(self._seed, self.plan.zones, self._textures)

    @cached_property
    def _textures(self) -> list[Array]:
        random, plan = self._random("textures"), self.plan
        return [
            painted(random, FLOOR_KINDS[kind], colour)
            for kind, colour in zip(plan.kinds[:OWN], plan.colours[:OWN], strict=True)
        ]

    @cached_property
    def _water(self) -> Water:
        return Water(self._random("water"))

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/octopus {part}")


@lru_cache(maxsize=4)
def _plan(seed: int) -> Plan:
    return drawn_plan(seed)
