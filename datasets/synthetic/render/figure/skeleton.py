"""Bones of the worker: their frames in the world, for all poses at once.

The world is x to the right, y up, z away from the camera [metres]. A bone's axes are its left,
up and forward.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.figure.clothes import FOREARM, NECK, SHOULDER, TRUNK, UPPER_ARM
from datasets.synthetic.render.figure.look import Look
from datasets.synthetic.render.figure.routine import Routine

__all__ = ["HEAD", "Bones", "place_bones"]

Array = NDArray[np.float64]

HEAD = 0
"""Which of the bones is the head's."""

CROWN = 0.252
"""Crown above the root of the neck [metres]."""


class Bones(NamedTuple):
    """Frames of head, neck, collar, trunk, upper arms, forearms, hands, legs, left before right.

    Attributes
    ----------
    axes : ndarray of float64, shape (n, 12, 3, 3)
        Columns are left, up and forward.
    origins : ndarray of float64, shape (n, 12, 3)
        [metres].
    """

    axes: Array
    origins: Array


def place_bones(routine: Routine, look: Look) -> Bones:
    """Frames of all bones in every frame of a routine."""
    nothing = np.zeros_like(routine.x)
    trunk = _turned(routine.heading, routine.lean, nothing)
    height = look.stature - CROWN - TRUNK - routine.crouch
    hips = np.stack([nothing, height, nothing], axis=1)
    root = hips + _at(trunk, 0, TRUNK, 0)
    head = _turned(routine.turn, routine.nod, routine.tilt)
    middle = (routine.heading + routine.turn) / 2
    neck = _turned(middle, 0.5 * (routine.lean + routine.nod) + 0.2, routine.tilt / 2)
    atlas = root + _at(neck, 0, NECK, 0)
    skull = atlas + _at(head, 0, 0.045, 0.018)
    axes, origins = [head, neck, trunk, trunk], [skull, root, root, hips]
    upright = _turned(routine.heading, nothing, nothing)
    uppers, lowers, hands = [], [], []
    for hand, side in enumerate((1, -1)):
        joint = root + _at(trunk, side * SHOULDER[0] * look.bulk, -SHOULDER[1], 0)
        working = root + _dot(upright, routine.hands[:, hand])
        at_face = skull + _at(head, side * 0.09, -0.015, 0.155)
        share = routine.to_face[:, hand, None]
        wrist = working + (at_face - working) * share
        aside = _at(trunk, side * 0.6, -1, -0.35)
        elbow, wrist = _bent(joint, wrist, aside)
        forward = trunk[:, :, 2]
        uppers.append((_along(joint - elbow, forward), joint))
        lowers.append((_along(elbow - wrist, forward), elbow))
        # A hand on its way to the face lies across the brow.
        across = _along(
            _unit(elbow - wrist) * (1 - 0.8 * share) + _at(head, side * 0.8, -0.35, 0) * share,
            forward,
        )
        hands.append((across, wrist))
    for frame, origin in [*uppers, *lowers, *hands]:
        axes.append(frame)
        origins.append(origin)
    for side in (1, -1):
        axes.append(upright)
        origins.append(hips + _at(upright, side * 0.085 * look.bulk, 0, 0))
    # The routine says where the head is; the rest follows.
    places = np.stack(origins, axis=1)
    there = np.stack([routine.x - skull[:, 0], nothing, routine.z - skull[:, 2]], axis=1)
    return Bones(np.stack(axes, axis=1), places + there[:, None])


def _turned(heading: Array, pitch: Array, roll: Array) -> Array:
    """Axes of what faces a heading, is pitched down and rolled to the left; (n, 3, 3)."""
    nothing = np.zeros_like(heading)
    ahead = np.stack([np.cos(heading), nothing, -np.sin(heading)], axis=1)
    left = np.stack([np.sin(heading), nothing, np.cos(heading)], axis=1)
    up = np.array([0.0, 1.0, 0.0])
    cos, sin = np.cos(pitch)[:, None], np.sin(pitch)[:, None]
    ahead, up = cos * ahead - sin * up, sin * ahead + cos * up
    cos, sin = np.cos(roll)[:, None], np.sin(roll)[:, None]
    left, up = cos * left - sin * up, sin * left + cos * up
    return np.stack([left, up, ahead], axis=2)


def _dot(axes: Array, places: Array) -> Array:
    return np.asarray((axes * places[:, None, :]).sum(axis=2))


def _at(axes: Array, left: float, up: float, forward: float) -> Array:
    return left * axes[:, :, 0] + up * axes[:, :, 1] + forward * axes[:, :, 2]


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.sqrt((vectors * vectors).sum(axis=1, keepdims=True)))


def _along(up: Array, forward: Array) -> Array:
    """Axes whose y is along `up`, and z as far along `forward` as that allows."""
    up = _unit(up)
    left = _unit(np.cross(forward, up))
    return np.stack([left, up, np.cross(up, left)], axis=2)


def _bent(joint: Array, wrist: Array, aside: Array) -> tuple[Array, Array]:
    """Elbow and wrist of an arm that reaches for a place as far as it can."""
    way = wrist - joint
    length = np.sqrt((way * way).sum(axis=1, keepdims=True))
    towards = way / length
    length = np.clip(length, 0.12, 0.985 * (UPPER_ARM + FOREARM))
    along = (length * length + UPPER_ARM**2 - FOREARM**2) / (2 * length)
    off = np.sqrt(np.maximum(UPPER_ARM**2 - along * along, 0.0))
    aside = _unit(aside - (aside * towards).sum(axis=1, keepdims=True) * towards)
    return joint + along * towards + off * aside, joint + length * towards
