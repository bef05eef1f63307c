"""`nguyen2002/lights`: a printed thing in a hand, in a room with two lamps.

The paper says: a sequence of its own, with several complete occlusions and abrupt changes of
illumination, which were made by turning off one of the light sources. All the rest is ours: what
is held, how it moves, what passes before it and how often, that the lamp goes on again.
"""

from functools import lru_cache

import cv2
import numpy as np

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.nguyen2002.knobs import LightsKnobs
from trackmark.datasets.synthetic.nguyen2002.lights.lighting import Lighting, drawn_lamps
from trackmark.datasets.synthetic.nguyen2002.lights.plan import FRAMES, SIZE, LightsPlan
from trackmark.datasets.synthetic.nguyen2002.lights.setting import CardPose, LightsSetting
from trackmark.datasets.synthetic.render.camera import LENS, Camera
from trackmark.datasets.synthetic.render.finish import GAMMA
from trackmark.datasets.synthetic.scene import SceneTruth, SyntheticScene, part_generator

EXPOSURE = 0.5  # part of the time between two frames for which the shutter is open
SENSITIVITY = 0.92  # of the camera, which stays as it is: what light of 1 on white comes to
# How far out of the picture something is that casts no shadow into it any more [pixels].
REACH = 400.0
CAMERA = Camera(SIZE, noise=2.0, fall=(0.04, 0.06))


def scene(knobs: LightsKnobs) -> "LightsScene":
    """Renderer and truth; nothing is drawn yet."""
    return LightsScene(knobs.scene)


class LightsScene(SyntheticScene):
    """A printed thing in a hand, in the light of two lamps."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.setting = _setting(seed)
        self.plan = self.setting.plan

    def truth(self) -> SceneTruth:
        """See `SyntheticScene.truth`.

        Boxes are those of the object upright, hidden parts included; its slight tilt does not
        enlarge them. Attributes are `occluded` (less than half of it is seen), `partly occluded`
        (less than nine tenths, but not occluded) and `lamp off`.
        """
        return _truth(self._seed)

    def render(self, frame: int) -> Image:
        """See `SyntheticScene.render`."""
        lighting = _lighting(self._seed)
        on = [0, 1] if self.plan.lit(frame) else [1]
        passing = [
            (number, pose, 2 * round(abs(self.plan.passings[number].pace) * EXPOSURE / 2) + 1)
            for number, pose in _passing(self.plan, frame)
        ]
        facing = self.plan.facing(frame)
        picture = lighting.picture(on, _pose(self.plan, frame), facing, passing)
        seen = SENSITIVITY * np.asarray(cv2.GaussianBlur(picture, (0, 0), LENS))
        canvas: Image = np.round(255 * np.clip(seen, 0, 1) ** (1 / GAMMA)).astype(np.uint8)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `SyntheticScene.mask`."""
        seen = self.setting.silhouette.at(_pose(self.plan, frame))[0][..., 0]
        for number, passer in _passing(self.plan, frame):
            seen = seen * (1 - self.setting.passers[number].at(passer)[0][..., 3])
        return np.asarray(seen >= 0.5)


def _pose(plan: LightsPlan, frame: int) -> CardPose:
    return CardPose(plan.place(frame), float(plan.scale(frame)), float(plan.tilt(frame)))


def _passing(plan: LightsPlan, frame: int) -> list[tuple[int, CardPose]]:
    """What is in the picture or shades it, by its number, and where."""
    poses = []
    for number, passing in enumerate(plan.passings):
        column = float(plan.passer(passing, frame))
        if -REACH < column < SIZE[0] + REACH:
            poses.append((number, CardPose((column, SIZE[1] / 2))))
    return poses


@lru_cache(maxsize=4)
def _setting(seed: int) -> LightsSetting:
    return LightsSetting(seed)


@lru_cache(maxsize=4)
def _lighting(seed: int) -> Lighting:
    random = part_generator(seed, "nguyen2002/lights lamps")
    return Lighting(_setting(seed), drawn_lamps(random))


@lru_cache(maxsize=4)
def _truth(seed: int) -> SceneTruth:
    setting = _setting(seed)
    plan = setting.plan
    times = np.arange(FRAMES)
    size = setting.extent * plan.scale(times)[:, None]
    points, whole = setting.points
    visibility = np.full(FRAMES, len(points) / whole)
    shades = [card.shade() for card in setting.passers]
    for frame in range(FRAMES):
        seen = _pose(plan, frame).onto_picture(points)[:, None]
        for number, passer in _passing(plan, frame):
            visibility[frame] *= 1 - shades[number].at(passer, seen.astype(np.float32)).mean()
    occluded = visibility < 0.5
    return SceneTruth(
        np.hstack([plan.place(times) - size / 2, size]),
        visibility,
        {
            "occluded": occluded,
            "partly occluded": (visibility < 0.9) & ~occluded,
            "lamp off": np.array([not plan.lit(frame) for frame in range(FRAMES)]),
        },
    )
