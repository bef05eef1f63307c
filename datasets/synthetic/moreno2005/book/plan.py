"""How the book moves, how it bends, and the colour of the light, in every frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.sheet import Bending
from datasets.synthetic.render.path import smooth_step
from datasets.synthetic.render.views import wandering

__all__ = ["FRAMES", "SIZE", "Plan", "Pose", "drawn_plan"]

Array = NDArray[np.float64]

FRAMES = 100

SIZE = 320, 240

SETTLED = 15.0
"""Frame from which on the book turns as far as ever."""

DISTANCE = 800.0
"""Of the camera from the book [pixels]."""

SWAY = (1.4, 4.0)
"""Periods of what moves [seconds]."""


@dataclass(frozen=True)
class Pose:
    """Where the held place is and how the book is turned there.

    Attributes
    ----------
    place : ndarray of float64, shape (2,)
        Column and row [pixels].
    axes : ndarray of float64, shape (3, 3)
        Columns are the directions of u, v and w, to the right, down and towards the camera.
    tilt : float
        In the picture, to the right [radians].
    scale : float
    """

    place: Array
    axes: Array
    tilt: float
    scale: float

    def seen(self, points: Array) -> Array:
        """Where points of the book are: column, row and nearness [pixels], shape (k, 3)."""
        turned = self.scale * points @ self.axes.T
        larger = DISTANCE / (DISTANCE - turned[:, 2:])
        return np.hstack([self.place + turned[:, :2] * larger, turned[:, 2:]])


@dataclass(frozen=True)
class Plan:
    """Course of a sequence.

    Attributes
    ----------
    poses : tuple of Pose
    bendings : tuple of Bending
    """

    poses: tuple[Pose, ...]
    bendings: tuple[Bending, ...]


def drawn_plan(random: np.random.Generator, height: float, side: float) -> Plan:
    """A course, drawn at random.

    Parameters
    ----------
    random : numpy.random.Generator
    height : float
        Of the book [pixels].
    side : {-1, 1}
        Where the light comes from: 1 is the right.
    """
    middle = np.array([160.0, 106 + height / 2]) + random.uniform(-1, 1, 2) * [22, 8]
    x, y = (wandering(random, FRAMES, SWAY, spread) for spread in (11.0, 5.0))
    turns = [wandering(random, FRAMES, SWAY, spread) for spread in (0.07, 0.14, 0.09)]
    for turn in turns[1:]:  # it faces the camera at first
        turn *= smooth_step(np.arange(float(FRAMES)), -2.0, SETTLED)
    scales = 1 + wandering(random, FRAMES, SWAY, 0.025)
    poses = tuple(
        Pose(middle + [x[k], y[k]], _axes(*(float(turn[k]) for turn in turns)),
             float(turns[0][k]), float(scales[k]))
        for k in range(FRAMES)
    )  # fmt: skip
    return Plan(poses, _bendings(random, side))


def _axes(tilt: float, yaw: float, pitch: float) -> Array:
    (a, b, c), (d, e, f) = np.cos([tilt, yaw, pitch]), np.sin([tilt, yaw, pitch])
    in_picture = np.array([[a, -d, 0], [d, a, 0], [0, 0, 1]])
    aside = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    over = np.array([[1, 0, 0], [0, c, -f], [0, f, c]])
    return np.asarray(in_picture @ over @ aside)


def _bendings(random: np.random.Generator, side: float) -> tuple[Bending, ...]:
    """Bent and let go again and again; it is let go at first.

    The side away from the light is bent away from the camera, the one towards the light
    towards it, or both: either way there is less light on it.
    """
    times, keys = [0.0, random.uniform(5, 8)], [_let_go(random)] * 2
    kinds = cycle(random.permutation(["far", "near", "both"]).tolist())
    while times[-1] < FRAMES:
        times += [times[-1] + random.uniform(9, 15)] * 2
        times[-1] += random.uniform(2, 8)
        keys += [_bent(random, next(kinds))] * 2
        times.append(times[-1] + random.uniform(9, 14))
        keys.append(_let_go(random))
    far, near, slant = _eased(np.arange(float(FRAMES)), times, np.array(keys)).T
    left, right = (far, near) if side > 0 else (near, far)
    return tuple(Bending(*values) for values in np.stack([left, right, slant], axis=1).tolist())


def _let_go(random: np.random.Generator) -> tuple[float, float, float]:
    return random.uniform(0.0, 0.25), random.uniform(-0.15, 0.2), random.uniform(-0.3, 0.3)


def _bent(random: np.random.Generator, kind: str) -> tuple[float, float, float]:
    far = random.uniform(0.2, 0.6) if kind == "near" else random.uniform(1.1, 1.6)
    near = random.uniform(-0.4, 0.4) if kind == "far" else -random.uniform(0.9, 1.3)
    return far, near, random.uniform(-0.7, 0.7)


def _eased(at: Array, times: Sequence[float], values: Array) -> Array:
    """Values at moments between those of keys, at rest at every key."""
    whole = np.interp(at, times, np.arange(len(values)))
    first = np.minimum(whole.astype(np.int64), len(values) - 2)
    share = smooth_step(whole - first, 0.0, 1.0)[:, None]
    return np.asarray(values[first] * (1 - share) + values[first + 1] * share)
