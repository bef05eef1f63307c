"""`wang2010/hand`: a hand crosses a face of its own colour.

The authors recorded 100 frames of 160 x 120 pixels of a moving hand; in frame 49 there is a face
behind the hand. The paper shows frames 10, 38, 49 and 58. All other properties are our choice: the
person, the office, and the path of the hand. The hand enters on one side, passes in front of the
face and leaves on the other side; in frame 49 it is centred on the face. The paper's frame k is
frame k - 1 here.
"""

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.figure.look import FigureLook
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.views import random_wander
from trackmark.datasets.synthetic.scene import SceneTruth, SyntheticScene, part_generator
from trackmark.datasets.synthetic.wang2010.hand import setting
from trackmark.datasets.synthetic.wang2010.hand.hand import (
    CENTRED,
    FRAMES,
    Hand,
    animate_hand,
    hand_textures,
    sample_path,
    sample_pose,
)

Array = NDArray[np.float64]

SIZE = 160, 120

PORTRAIT = 160, 144  # size of the image of the person, which extends below the image [pixels]
EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
CAMERA = Camera(SIZE, noise=2.2)

# width and height of the face without hair and ears [head heights]
FACE = np.array([0.66, 0.74])
SWAY = 0.25  # standard deviation of the position of the seated person [pixels]


def scene(knobs: SceneKnobs) -> "HandScene":
    """Return the renderer with its ground truth, without rendering."""
    return HandScene(knobs.scene)


class HandScene(SyntheticScene):
    """Scene of a hand in front of a face in an office."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.hand = _hand(seed)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes contain the hand without the sleeve; the hand is never occluded. The attribute `on the
        face` means that the boxes of hand and face overlap.
        """
        boxes = self.hand.boxes
        middle, head = _face_position(self._seed)
        low, high = middle - head * FACE / 2, middle + head * FACE / 2
        overlap = np.logical_and(boxes[:, :2] < high, boxes[:, :2] + boxes[:, 2:] > low)
        before = np.asarray(overlap.all(axis=1))
        return SceneTruth(boxes, np.ones(FRAMES), {"on the face": before})

    def render(self, frame: int) -> Image:
        canvas = self._room.copy()
        self._portrait.draw(canvas, self._sway[frame][None], 1 / setting.FINE)
        poses, frames = self._exposed(frame)
        setting.paint(canvas, poses, frames, self._textures, _lamp(self._seed) * [1, -1, -1, 1])
        return CAMERA.exposed(canvas, self._seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        samples = setting.cover(self.hand.cones[frame], setting.SKIN, *SIZE[::-1])
        return np.asarray(2 * samples >= setting.FINE**2)

    def _exposed(self, frame: int) -> tuple[Array, Array]:
        """Return `moments` and `frames` of `setting.paint` for a frame."""
        around = max(frame - 1, 0), min(frame + 1, FRAMES - 1)
        moments = ((np.arange(setting.FINE) + 0.5) / setting.FINE - 0.5) * EXPOSURE
        both = []
        for values in (self.hand.cones, self.hand.frames):
            rate = (values[around[1]] - values[around[0]]) / (around[1] - around[0])
            both.append(values[frame] + moments[:, None, None] * rate)
        return both[0], both[1]

    @cached_property
    def _room(self) -> Image:
        random = part_generator(self._seed, "wang2010/hand room")
        return setting.office(random, *SIZE)

    @cached_property
    def _portrait(self) -> Sprite:
        random = part_generator(self._seed, "wang2010/hand portrait")
        _, head = _face_position(self._seed)
        return setting.portrait(random, _look(self._seed), _lamp(self._seed), head, PORTRAIT)

    @cached_property
    def _sway(self) -> Array:
        """Centre of the face in every frame [pixels]; the ground truth uses the frame `CENTRED`."""
        random = part_generator(self._seed, "wang2010/hand sway")
        sway = [random_wander(random, FRAMES, (2.0, 6.0), SWAY) for _ in range(2)]
        middle, _ = _face_position(self._seed)
        return np.asarray(middle + np.stack(sway, axis=1) - [s[CENTRED] for s in sway])

    @cached_property
    def _textures(self) -> Array:
        random = part_generator(self._seed, "wang2010/hand textures")
        return hand_textures(random, _side(self._seed))

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self._seed, "wang2010/hand exposure")
        return 1.05 * slow_exposure(random, FRAMES, (4.0, 12.0), 0.008)


def _side(seed: int) -> int:
    """Return 1 if the hand moves to the right, otherwise -1."""
    return int(part_generator(seed, "wang2010/hand side").choice([-1, 1]))


def _face_position(seed: int) -> tuple[Array, float]:
    """Return the centre of the face and the height of the head [pixels]."""
    random = part_generator(seed, "wang2010/hand place")
    return np.array([80.0, 54.0]) + random.uniform(-4, 4, 2) * [1, 0.75], random.uniform(40, 43)


def _look(seed: int) -> FigureLook:
    return setting.sample_person(part_generator(seed, "wang2010/hand look"))


def _lamp(seed: int) -> Array:
    """Return the direction to the window (y up, z away), and the ambient light."""
    random = part_generator(seed, "wang2010/hand lamp")
    lamp = np.array([random.choice([-1, 1]) * random.uniform(0.35, 0.65), 0.6, -0.75])
    return np.append(lamp / np.sqrt((lamp * lamp).sum()), 0.5)


@lru_cache(maxsize=4)
def _hand(seed: int) -> Hand:
    random = part_generator(seed, "wang2010/hand way")
    look, side = _look(seed), _side(seed)
    path = sample_path(random, side)
    pose = sample_pose(random, path)
    middle, head = _face_position(seed)
    skin = np.array(look.skin) * random.uniform(0.98, 1.06)
    scale = head * random.uniform(0.0365, 0.0385)
    return animate_hand(pose, path, middle, CENTRED, scale, side, skin, look.clothes)
