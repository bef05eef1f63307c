"""How the book moves, how it bends, and the colour of the light, in every frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.book.sheet import Bending
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.triangles import turned_axes
from trackmark.datasets.synthetic.render.views import wandering

Array = NDArray[np.float64]

FRAMES = 100
SIZE = 320, 240
SETTLED = 15.0  # frame from which on the book turns as far as ever
DISTANCE = 800.0  # of the camera from the book [pixels]
SWAY = (1.4, 4.0)  # periods of the slow movements [seconds]
QUICK = 1  # duration of a bend [frames]; between two frames, so that its shadow is sudden
SLOW = 2, 4  # duration of letting go [frames]
HELD = 2, 4  # time until the next movement [frames]


@dataclass(frozen=True)
class Pose:
    """Where the held place is and how the book is turned there."""

    place: Array  # (2,): column and row [pixels]
    # (3, 3): columns are the directions of u, v and w, to the right, down and towards the camera
    axes: Array
    tilt: float  # in the picture, to the right [radians]
    scale: float

    def seen(self, points: Array) -> Array:
        """Where points of the book are: column, row and nearness [pixels], shape (k, 3)."""
        turned = self.scale * points @ self.axes.T
        larger = DISTANCE / (DISTANCE - turned[:, 2:])
        return np.hstack([self.place + turned[:, :2] * larger, turned[:, 2:]])


@dataclass(frozen=True)
class Plan:
    """Course of a sequence."""

    poses: tuple[Pose, ...]
    bendings: tuple[Bending, ...]


def drawn_plan(random: np.random.Generator, height: float, side: float) -> Plan:
    """A course, drawn at random, of a book of a height [pixels].

    `side` is 1 where the light comes from the right, -1 where it comes from the left.
    """
    middle = np.array([160.0, 106 + height / 2]) + random.uniform(-1, 1, 2) * [22, 8]
    x, y = (wandering(random, FRAMES, SWAY, spread) for spread in (11.0, 5.0))
    turns = [wandering(random, FRAMES, SWAY, spread) for spread in (0.07, 0.06, 0.06)]
    for turn in turns[1:]:  # it faces the camera at first
        turn *= smooth_step(np.arange(float(FRAMES)), -2.0, SETTLED)
    scales = 1 + wandering(random, FRAMES, SWAY, 0.025)
    away, bendings = _movements(random, side)
    turns[1] -= side * away
    poses = tuple(
        Pose(middle + [x[k], y[k]], turned_axes(*(float(turn[k]) for turn in turns)),
             float(turns[0][k]), float(scales[k]))
        for k in range(FRAMES)
    )  # fmt: skip
    return Plan(poses, bendings)


def _movements(random: np.random.Generator, side: float) -> tuple[Array, tuple[Bending, ...]]:
    """Return the turn away from the light [radians] and the bending of the book by frame.

    The book is bent and turned away again and again, and let go more slowly. The side away
    from the light is bent away from the camera, the other side towards it, or both: its own
    shadow then covers most of it.
    """
    times, keys = [0, int(random.integers(5, 8))], [_let_go(random)] * 2
    kinds = cycle(random.permutation(["far", "near", "both"]).tolist())
    while times[-1] < FRAMES:
        bend = times[-1] + QUICK
        release = bend + int(random.integers(*HELD, endpoint=True))
        end = release + int(random.integers(*SLOW, endpoint=True))
        times += [bend, release, end, end + int(random.integers(*HELD, endpoint=True))]
        keys += [_bent(random, next(kinds))] * 2
        keys += [_let_go(random)] * 2
    far, near, slant, away = _eased(np.arange(float(FRAMES)), times, np.array(keys)).T
    left, right = (far, near) if side > 0 else (near, far)
    bendings = np.stack([left, right, slant], axis=1).tolist()
    return away, tuple(Bending(*values) for values in bendings)


def _let_go(random: np.random.Generator) -> tuple[float, float, float, float]:
    bending = random.uniform(0.0, 0.25), random.uniform(-0.15, 0.2), random.uniform(-0.3, 0.3)
    return *bending, -random.uniform(0.05, 0.15)


def _bent(random: np.random.Generator, kind: str) -> tuple[float, float, float, float]:
    far = random.uniform(0.2, 0.6) if kind == "near" else random.uniform(0.4, 0.7)
    near = random.uniform(-0.4, 0.4) if kind == "far" else -random.uniform(0.4, 0.7)
    return far, near, random.uniform(-0.4, 0.4), random.uniform(0.28, 0.4)


def _eased(at: Array, times: Sequence[int], values: Array) -> Array:
    """Values at moments between those of keys, at rest at every key."""
    whole = np.interp(at, times, np.arange(len(values)))
    first = np.minimum(whole.astype(np.int64), len(values) - 2)
    share = smooth_step(whole - first, 0.0, 1.0)[:, None]
    return np.asarray(values[first] * (1 - share) + values[first + 1] * share)
