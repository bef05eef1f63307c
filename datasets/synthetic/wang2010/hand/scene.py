"""`wang2010/hand`: a hand crosses a face of its own colour.

The authors recorded 100 frames of 160 x 120 pixels of a moving hand; in frame 49 there is a face
behind the hand. The paper shows frames 10, 38, 49 and 58. All other properties are our choice: the
person, the office, and the path of the hand. The hand enters on one side, passes in front of the
face and leaves on the other side; in frame 49 it is centred on the face. The paper's frame k is
frame k - 1 here.

The hand has closed fingers and a sleeved forearm; the palm faces the camera. The constants describe
a right hand in centimetres: x to the right, y up from the wrist, z towards the camera. Its thumb is
on the right in the image.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.figure.look import FigureLook
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.views import random_wander
from trackmark.datasets.synthetic.scene import SceneTruth, SyntheticScene, part_generator
from trackmark.datasets.synthetic.wang2010.hand import setting
from trackmark.datasets.synthetic.wang2010.hand.setting import BLUE, CLOTH, COLUMNS, CREASE, SKIN

SIDE = 256  # rows and columns of a texture
TEXELS = 10.0  # texels per centimetre
WRIST_ROW = 226  # texture row of the wrist


def hand_textures(random: Generator, side: int) -> Array:
    """Return the light gains of skin and cloth, shape (2, SIDE, SIDE); see `setting.paint`.

    `side` is 1 for a right hand and -1 for a left hand.
    """
    y, x = np.indices((SIDE, SIDE))
    right, up = (x + 0.5 - SIDE / 2) / TEXELS * side, (WRIST_ROW - y) / TEXELS
    shift = random.uniform(-0.25, 0.25, 3)
    around = np.hypot(right - 4.3, up - 2.6)  # distance from the ball of the thumb
    life = _line(around - 3.9 - shift[0], 0.22) * (up > 1.2) * (up < 6.6) * (right < 3.4)
    heart = _line(up - 7.6 - shift[1] + 0.09 * np.square(right - 1.6), 0.20)
    heart = heart * (right > -3.6) * (right < 1.6)
    head = _line(up - 5.9 - shift[2] + 0.07 * np.square(right - 2.6), 0.18)
    head = head * (right > -2.4) * (right < 2.8)
    wrist = _line(up - 0.1 - 0.03 * np.square(right), 0.16) * (np.abs(right) < 2.4)
    skin = 1 + 0.035 * fractal(random, SIDE, 8, 64, 0.8)
    skin = skin * (1 - 0.17 * np.clip(life + heart + 0.8 * head + wrist, 0, 1))
    folds = fractal(random, SIDE, 8, 32, 0.7)
    cloth = 1 + 0.05 * fractal(random, SIDE, 4, 16) + 0.30 * (folds - np.roll(folds, 3, axis=0))
    return np.stack([skin, cloth + random.normal(0, 0.03, cloth.shape)])


def _line(distance: Array, width: float) -> Array:
    return np.asarray(1 / (1 + np.square(np.square(distance / width))))


FRAMES = 100
CENTRED = 48  # frame in which the hand is centred on the face, which is frame 49 of the paper
FINGERS = 5  # thumb first, little finger last
JOINTS = 3


@dataclass(frozen=True)
class HandPose:
    """Joint angles of a hand in every frame [radians]."""

    tilt: Array  # (n,): angle of the hand, from upright to the right
    arm_tilt: Array  # (n,): angle of the forearm, from upright to the right
    yaw: Array  # (n,): rotation of the palm to the right
    pitch: Array  # (n,): rotation of the fingers towards the camera
    # (FINGERS, n): deviation of each finger from its rest direction, in the plane of the palm
    spread: Array
    bend: Array  # (FINGERS, 3, n): bending of each joint towards the palm


def sample_path(random: Generator, side: int) -> Array:
    """Sample positions relative to the position in frame `CENTRED`, shape (FRAMES, 2) [pixels].

    The hand moves to the right if `side` is 1, and to the left if it is -1. It is faster in the
    middle of the path. The path is slightly irregular.
    """
    time = np.arange(FRAMES) - CENTRED
    slow, fast, long = random.uniform(0.95, 1.02), random.uniform(1.4, 1.65), random.uniform(22, 27)
    swell = np.clip(1 - np.square(time / long), 0, None)
    across = np.cumsum(slow + (fast - slow) * swell * swell)
    across += random_wander(random, FRAMES, (1.2, 3.5), 0.5)
    sag = random.uniform(3, 7) * np.square(time / CENTRED)  # circular arc around the elbow
    lean = random.uniform(-4, 4) * time / CENTRED
    down = sag + lean + random_wander(random, FRAMES, (1.2, 4.0), 1.3)
    path = np.stack([side * across, down], axis=1)
    return np.asarray(path - path[CENTRED])


def sample_pose(random: Generator, path: Array) -> HandPose:
    """Sample a relaxed hand with closed fingers on a path of `sample_path`.

    The tilt of the forearm grows with the distance that it must reach.
    """

    def wave(periods: tuple[float, float], degrees: float) -> Array:
        return np.radians(random_wander(random, FRAMES, periods, degrees))

    reach = path[:, 0] / np.abs(path[:, 0]).max()
    arm_tilt = np.radians(random.uniform(6, 11)) * reach + wave((2.0, 5.0), 1.5)
    tilt = np.radians(random.uniform(1, 3)) * reach + wave((1.2, 3.5), 1.2)
    rest = np.radians(random.uniform(8, 17, (FINGERS, JOINTS, 1)))
    together = wave((1.5, 4.0), 5.0)
    bends = [[wave((0.9, 2.5), 2.0) for _ in range(JOINTS)] for _ in range(FINGERS)]
    return HandPose(
        tilt,
        arm_tilt,
        np.radians(random.uniform(-14, 14)) + wave((1.5, 4.0), 6.0),
        np.radians(random.uniform(-6, 6)) + wave((1.5, 4.0), 4.0),
        np.array([wave((1.0, 3.0), 0.8) for _ in range(FINGERS)]),
        rest + together + np.array(bends),
    )


# both ends of the bones in the palm with their radii: thumb, then the four fingers
_PALM = (
    ((1.7, 1.9, 0.3), (3.4, 4.9, 0.9), 1.55, 1.15),
    ((1.3, 1.5, 0.0), (2.9, 9.2, 0.0), 1.55, 1.15),
    ((0.4, 1.4, 0.0), (0.8, 9.6, 0.1), 1.50, 1.15),
    ((-0.5, 1.4, 0.0), (-1.2, 9.2, 0.0), 1.50, 1.10),
    ((-1.4, 1.5, 0.0), (-3.0, 8.2, -0.1), 1.45, 1.00),
)
_PADS = (
    ((1.6, 2.6, 0.55), (2.6, 4.8, 0.55), 1.55, 1.20),  # ball of the thumb
    ((-1.7, 2.3, 0.35), (-2.3, 5.4, 0.30), 1.50, 1.15),  # ball of the little finger
    ((2.4, 8.7, 0.35), (-2.4, 7.9, 0.30), 0.95, 0.90),  # below the fingers
)
# for each finger: direction [degrees to the right], lengths of bones, radii at their ends
_FINGERS = (
    (6, (3.1, 2.7), (1.15, 1.10, 0.82)),
    (-1, (4.2, 2.5, 2.0), (1.10, 1.02, 0.92, 0.74)),
    (0, (4.6, 2.8, 2.1), (1.12, 1.04, 0.94, 0.76)),
    (1, (4.3, 2.6, 2.1), (1.08, 1.00, 0.90, 0.74)),
    (2, (3.4, 2.0, 1.8), (0.98, 0.88, 0.80, 0.66)),
)
WRIST = 2.45  # half width of the wrist
CUFF = 0.9  # distance from the wrist to the sleeve
CREASED = 0.12  # fraction of light that the crease of a joint removes
FOREARM = 40.0  # length of the forearm, longer than real, so that the elbow is outside the image


@dataclass(frozen=True)
class Hand:
    """Shape of hand and forearm in every frame."""

    cones: Array  # (n, m, COLUMNS), see `setting.COLUMNS`; the cones of the hand come first
    frames: Array  # (n, 2, 4): positions of the textures; see `setting.paint`
    boxes: Array  # (n, 4): boxes of the hand without the sleeve [pixels]


def animate_hand(
    pose: HandPose, path: Array, place: ArrayLike, centred_frame: int, scale: float, side: int,
    skin: ArrayLike, cloth: ArrayLike,
) -> Hand:  # fmt: skip
    """Return a hand on its path, with the centre of its box at `place` in `centred_frame`.

    `path`, shape (n, 2), and `place` are in pixels, `scale` in pixels/centimetre. `side` is 1 for a
    right hand and -1 for a left hand. `skin` and `cloth` are BGR in [0, 255].
    """
    skin, cloth = np.asarray(skin, np.float64), np.asarray(cloth, np.float64)
    turn = _rotations(pose) * [side, 1.0, 1.0]
    bones = _hand_bones(pose, skin)
    parts = [
        _cone(_rotate(turn, bone.root), _rotate(turn, bone.tip), bone.radii, bone.colour,
              SKIN, crease=bone.crease)
        for bone in bones
    ]  # fmt: skip
    down = np.stack([-np.sin(pose.arm_tilt), np.cos(pose.arm_tilt), 0 * pose.tilt], axis=1)
    parts += _forearm(down, skin, cloth)
    cones = np.stack(parts, axis=1)
    cones[..., :BLUE] *= scale
    palm = len(bones)
    edge = CUFF * scale * down
    boxes = _boxes(cones[:, :palm], edge, WRIST * scale * np.abs(down[:, 0]))
    middle = boxes[centred_frame, :2] + boxes[centred_frame, 2:] / 2
    shift = quantised(path - path[centred_frame] + np.asarray(place, np.float64) - middle)
    cones[..., :BLUE] = quantised(cones[..., :BLUE])
    for end in (0, 4):
        cones[..., end : end + 2] += shift[:, None]
    boxes[:, :2] += shift
    frames = np.stack(
        [_texture_frame(shift, tilt, scale) for tilt in (pose.tilt, pose.arm_tilt)], axis=1
    )
    return Hand(cones, frames, boxes)


class _Bone(NamedTuple):
    """Bone of the hand: its two ends in every frame, shape (n, 3), radii and colour."""

    root: Array
    tip: Array
    radii: tuple[float, float]
    colour: Array
    crease: float


def _hand_bones(pose: HandPose, skin: Array) -> list[_Bone]:
    pale, rosy = skin * [1.0, 1.0, 1.02], skin * [0.88, 0.91, 1.03]
    still = np.ones((FRAMES, 1))
    bones = [
        _Bone(still * root, still * tip, (first, last), pale, 0.0)
        for root, tip, first, last in (*_PALM, *_PADS)
    ]
    for finger, (aside, lengths, radii) in enumerate(_FINGERS):
        joint = bones[finger].tip
        across, bent = np.radians(aside) + pose.spread[finger], np.zeros(FRAMES)
        for i, length in enumerate(lengths):
            bent = bent + pose.bend[finger, i]
            flat = np.cos(bent)
            path = np.stack([np.sin(across) * flat, np.cos(across) * flat, np.sin(bent)], axis=1)
            colour = rosy if i == len(lengths) - 1 else (pale + rosy) / 2
            ends = radii[i], radii[i + 1]
            bones.append(_Bone(joint, joint + length * path, ends, colour, CREASED))
            joint = bones[-1].tip
    return bones


def _rotations(pose: HandPose) -> Array:
    """Return rotations (n, 3, 3) from the axes of the hand to the image, whose y points down."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    nothing, unit = np.zeros(FRAMES), np.ones(FRAMES)
    yaw = np.array([[cos, nothing, sin], [nothing, unit, nothing], [-sin, nothing, cos]])
    cos, sin = np.cos(pose.pitch), np.sin(pose.pitch)
    pitch = np.array([[unit, nothing, nothing], [nothing, cos, -sin], [nothing, sin, cos]])
    cos, sin = np.cos(pose.tilt), np.sin(pose.tilt)
    tilt = np.array([[cos, sin, nothing], [sin, -cos, nothing], [nothing, nothing, unit]])
    return np.asarray(np.einsum("ijn,jkn,kln->nil", tilt, pitch, yaw))


def _rotate(turn: Array, points: Array) -> Array:
    return np.asarray((turn * points[:, None, :]).sum(axis=2))


def _cone(
    start: Array, end: Array, radii: ArrayLike, colour: Array, material: int,
    crease: float = 0.0, flat: bool = False,
) -> Array:  # fmt: skip
    cone = np.empty((len(start), COLUMNS))
    cone[:, :3], cone[:, 4:7] = start, end
    cone[:, 3:8:4] = radii
    cone[:, BLUE : BLUE + 3] = colour
    cone[:, CREASE:] = crease, material, flat
    return cone


def _forearm(down: Array, skin: Array, cloth: Array) -> list[Array]:
    """Return the cones of wrist, sleeve and cuff, in this order."""
    aside = np.stack([down[:, 1], -down[:, 0], 0 * down[:, 0]], axis=1)
    back = np.array([0.0, 0.0, 1.0])
    parts = []
    for offset in (-0.85, 0.85):
        start = offset * aside - 0.2 * back
        parts.append(_cone(start - 1.2 * down, start + 4 * down, (1.5, 1.6), skin, SKIN))
    elbow, below = FOREARM * down - 2.0 * back, (CUFF + 0.5) * down - 0.4 * back
    parts.append(_cone(elbow, below, (5.6, 2.95), cloth, CLOTH, flat=True))
    edge = CUFF * down - 0.3 * back
    parts.append(_cone(edge + 2.2 * down, edge, (2.9, 3.1), cloth * 0.84, CLOTH, flat=True))
    return parts


def _boxes(cones: Array, edge: Array, drop: Array) -> Array:
    """Return boxes around the cones of a hand, which ends at its sleeve."""
    balls = np.concatenate([cones[..., :4], cones[..., 4:8]], axis=1)
    low = (balls[..., :2] - balls[..., 3:]).min(axis=1)
    right = (balls[..., 0] + balls[..., 3]).max(axis=1)
    size = np.stack([right - low[:, 0], edge[:, 1] + drop - low[:, 1]], axis=1)
    return np.concatenate([low, size], axis=1)


def _texture_frame(wrist: Array, tilt: Array, scale: float) -> Array:
    """Return the row of `frames` in `setting.paint` for a texture with the wrist at a position."""
    cos, sin = np.cos(tilt), np.sin(tilt)
    left, up = SIDE / 2 / TEXELS * scale, WRIST_ROW / TEXELS * scale
    x = wrist[:, 0] - left * cos + up * sin
    y = wrist[:, 1] - left * sin - up * cos
    return np.stack([quantised(x), quantised(y), *(TEXELS / scale * np.array([cos, sin]))], axis=1)


SIZE = 160, 120

PORTRAIT = 160, 144  # size of the image of the person, which extends below the image [pixels]
EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
CAMERA = Camera(SIZE, noise=2.2)

# width and height of the face without hair and ears [head heights]
FACE = np.array([0.66, 0.74])
SWAY = 0.25  # standard deviation of the position of the seated person [pixels]


def scene(parameters: SceneParameters) -> "HandScene":
    """Return the scene, which gives the ground truth and renders frames on request."""
    return HandScene(parameters.scene)


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
        interpolated = []
        for values in (self.hand.cones, self.hand.frames):
            rate = (values[around[1]] - values[around[0]]) / (around[1] - around[0])
            interpolated.append(values[frame] + moments[:, None, None] * rate)
        return interpolated[0], interpolated[1]

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
        """Centre of the face in every frame [pixels]; `_face_position` in frame `CENTRED`."""
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
