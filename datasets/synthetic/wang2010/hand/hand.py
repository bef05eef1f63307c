"""An open hand on a sleeved forearm, the palm towards the camera, in every frame of a way.

Lengths are in centimetres and a right hand's: x to the right, y up from the wrist, z towards
the camera. The thumb is on the right, as one's own right hand looks to whom one waves at.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.path import quantised
from datasets.synthetic.wang2010.hand.cones import BLUE, CLOTH, COLUMNS, CREASE, SKIN
from datasets.synthetic.wang2010.hand.textures import SIDE, TEXELS, WRIST_ROW
from datasets.synthetic.wang2010.hand.way import FRAMES, Pose

__all__ = ["Hand", "hand_in_motion"]

Array = NDArray[np.float64]

# Root and tip of the bones in the palm with their radii: thumb, then the four fingers.
_PALM = (
    ((1.7, 1.9, 0.3), (4.2, 4.7, 0.9), 1.55, 1.15),
    ((1.3, 1.5, 0.0), (2.9, 9.2, 0.0), 1.55, 1.15),
    ((0.4, 1.4, 0.0), (0.8, 9.6, 0.1), 1.50, 1.15),
    ((-0.5, 1.4, 0.0), (-1.2, 9.2, 0.0), 1.50, 1.10),
    ((-1.4, 1.5, 0.0), (-3.0, 8.2, -0.1), 1.45, 1.00),
)
_PADS = (
    ((1.6, 2.6, 0.55), (2.6, 4.8, 0.55), 1.55, 1.20),  # of the thumb
    ((-1.7, 2.3, 0.35), (-2.3, 5.4, 0.30), 1.50, 1.15),  # of the little finger
    ((2.4, 8.7, 0.35), (-2.4, 7.9, 0.30), 0.95, 0.90),  # below the fingers
)
_FINGERS = (
    (38, (3.1, 2.7), (1.15, 1.10, 0.82)),
    (10, (4.2, 2.5, 2.0), (1.10, 1.02, 0.92, 0.74)),
    (2, (4.6, 2.8, 2.1), (1.12, 1.04, 0.94, 0.76)),
    (-6, (4.3, 2.6, 2.1), (1.08, 1.00, 0.90, 0.74)),
    (-17, (3.4, 2.0, 1.8), (0.98, 0.88, 0.80, 0.66)),
)
"""Where each points [degrees to the right], lengths of its bones, radii at their ends."""

WRIST = 2.45
"""Half its width."""

CUFF = 0.9
"""How far below the wrist the sleeve begins."""

CREASED = 0.12
"""Part of the light that a joint's crease takes."""

FOREARM = 40.0
"""Longer than it is: the elbow is out of the picture."""


@dataclass(frozen=True)
class Hand:
    """Hand and forearm in every frame.

    Attributes
    ----------
    cones : ndarray of float64, shape (n, m, COLUMNS)
        See `cones`; those of the hand first.
    frames : ndarray of float64, shape (n, 2, 4)
        Where the textures lie; see `cones.paint`.
    boxes : ndarray of float64, shape (n, 4)
        Around the hand, down to the sleeve [pixels].
    """

    cones: Array
    frames: Array
    boxes: Array


def hand_in_motion(
    pose: Pose, way: Array, place: ArrayLike, when: int, scale: float, side: int,
    skin: ArrayLike, cloth: ArrayLike,
) -> Hand:  # fmt: skip
    """A hand on its way.

    Parameters
    ----------
    pose : Pose
    way : ndarray of float64, shape (n, 2)
        Of the hand, up to a shift [pixels].
    place : array of float64, shape (2,)
        Where the middle of the hand's box is in the frame `when` [pixels].
    when : int
    scale : float
        [pixels/centimetre].
    side : {-1, 1}
        1 for a right hand.
    skin, cloth : array of float64, shape (3,)
        BGR in [0, 255].
    """
    skin, cloth = np.asarray(skin, np.float64), np.asarray(cloth, np.float64)
    turn = _turning(pose) * [side, 1.0, 1.0]
    bones = _hand_bones(pose, skin)
    parts = [
        _cone(_placed(turn, bone.root), _placed(turn, bone.tip), bone.radii, bone.colour,
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
    middle = boxes[when, :2] + boxes[when, 2:] / 2
    shift = quantised(way - way[when] + np.asarray(place, np.float64) - middle)
    cones[..., :BLUE] = quantised(cones[..., :BLUE])
    for end in (0, 4):
        cones[..., end : end + 2] += shift[:, None]
    boxes[:, :2] += shift
    frames = np.stack(
        [_texture_frame(shift, tilt, scale) for tilt in (pose.tilt, pose.arm_tilt)], axis=1
    )
    return Hand(cones, frames, boxes)


class _Bone(NamedTuple):
    """What a part of the hand is drawn around; its ends in every frame, shape (n, 3)."""

    root: Array
    tip: Array
    radii: tuple[float, float]
    colour: Array
    crease: float


def _hand_bones(pose: Pose, skin: Array) -> list[_Bone]:
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
            way = np.stack([np.sin(across) * flat, np.cos(across) * flat, np.sin(bent)], axis=1)
            colour = rosy if i == len(lengths) - 1 else (pale + rosy) / 2
            ends = radii[i], radii[i + 1]
            bones.append(_Bone(joint, joint + length * way, ends, colour, CREASED))
            joint = bones[-1].tip
    return bones


def _turning(pose: Pose) -> Array:
    """Rotations from the hand into the picture, shape (n, 3, 3); y down there."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    nothing, one = np.zeros(FRAMES), np.ones(FRAMES)
    yaw = np.array([[cos, nothing, sin], [nothing, one, nothing], [-sin, nothing, cos]])
    cos, sin = np.cos(pose.pitch), np.sin(pose.pitch)
    pitch = np.array([[one, nothing, nothing], [nothing, cos, -sin], [nothing, sin, cos]])
    cos, sin = np.cos(pose.tilt), np.sin(pose.tilt)
    tilt = np.array([[cos, sin, nothing], [sin, -cos, nothing], [nothing, nothing, one]])
    return np.asarray(np.einsum("ijn,jkn,kln->nil", tilt, pitch, yaw))


def _placed(turn: Array, points: Array) -> Array:
    return np.asarray((turn * points[:, None, :]).sum(axis=2))


def _cone(
    start: Array, end: Array, radii: ArrayLike, colour: Array, material: int,
    crease: float = 0.0, flat: bool = False,
) -> Array:  # fmt: skip
    """Cone in every frame, shape (n, COLUMNS)."""
    cone = np.empty((len(start), COLUMNS))
    cone[:, :3], cone[:, 4:7] = start, end
    cone[:, 3:8:4] = radii
    cone[:, BLUE : BLUE + 3] = colour
    cone[:, CREASE:] = crease, material, flat
    return cone


def _forearm(down: Array, skin: Array, cloth: Array) -> list[Array]:
    """Wrist, sleeve and cuff, from the wrist down."""
    aside = np.stack([down[:, 1], -down[:, 0], 0 * down[:, 0]], axis=1)
    back = np.array([0.0, 0.0, 1.0])
    parts = []
    for by in (-0.85, 0.85):
        start = by * aside - 0.2 * back
        parts.append(_cone(start - 1.2 * down, start + 4 * down, (1.5, 1.6), skin, SKIN))
    elbow, below = FOREARM * down - 2.0 * back, (CUFF + 0.5) * down - 0.4 * back
    parts.append(_cone(elbow, below, (5.6, 2.95), cloth, CLOTH, flat=True))
    edge = CUFF * down - 0.3 * back
    parts.append(_cone(edge + 2.2 * down, edge, (2.9, 3.1), cloth * 0.84, CLOTH, flat=True))
    return parts


def _boxes(cones: Array, edge: Array, drop: Array) -> Array:
    """Boxes around the cones of a hand that ends where its sleeve begins."""
    balls = np.concatenate([cones[..., :4], cones[..., 4:8]], axis=1)
    low = (balls[..., :2] - balls[..., 3:]).min(axis=1)
    right = (balls[..., 0] + balls[..., 3]).max(axis=1)
    size = np.stack([right - low[:, 0], edge[:, 1] + drop - low[:, 1]], axis=1)
    return np.concatenate([low, size], axis=1)


def _texture_frame(wrist: Array, tilt: Array, scale: float) -> Array:
    """See `cones.paint`, for a texture whose wrist is at a place."""
    cos, sin = np.cos(tilt), np.sin(tilt)
    left, up = SIDE / 2 / TEXELS * scale, WRIST_ROW / TEXELS * scale
    x = wrist[:, 0] - left * cos + up * sin
    y = wrist[:, 1] - left * sin - up * cos
    return np.stack([quantised(x), quantised(y), *(TEXELS / scale * np.array([cos, sin]))], axis=1)
