"""What happens in a clip: ways of target and camera, what passes when, how light it is."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nguyen2002.film.hiders import HIDERS
from datasets.synthetic.nguyen2002.film.script import Shot, script
from datasets.synthetic.nguyen2002.film.settings import SETTINGS
from datasets.synthetic.render.path import quantised
from datasets.synthetic.render.views import Camera, wandering
from datasets.synthetic.scene import part_generator

__all__ = ["EXPOSURE", "SIZE", "Passage", "Plan", "plan"]

Array = NDArray[np.float64]

SIZE = 320, 240

EXPOSURE = 0.5
"""Part of the time between two frames for which the shutter is open."""

NEAR = 45.0
"""Of the target's plane [pixels/metre]: the camera's travel in metres is seen as large there."""

FASTEST = 5.0
"""Of the camera that moves along, in the target's plane [pixels/frame]."""

DRIFT = 3.0
"""Of the target at most, across the picture and down, as the camera follows it [pixels/frame]."""

LEAD, GAP, END = 16, 12, 20
"""Frames, at least, before anything passes, between two that pass, and after the last."""

WIDTHS = 1.35, 1.9
"""Of what hides all of the target [the target's width]."""

SPEEDS = 0.08, 0.15
"""Of what passes, across the picture [the target's width a frame]."""


@dataclass(frozen=True)
class Passage:
    """Something that passes before the target.

    Attributes
    ----------
    kind : str
        Name of `hiders.HIDERS`.
    size : tuple of float
        Width and height of what hides [pixels].
    way : ndarray of float64, shape (frames, 2)
        Of its anchor [pixels].
    """

    kind: str
    size: tuple[float, float]
    way: Array


@dataclass(frozen=True)
class Plan:
    """A clip before anything is painted.

    Attributes
    ----------
    shot : Shot
    size : tuple of float
        Width and height of the target at scale 1 [pixels].
    centre : ndarray of float64, shape (frames, 2)
        Of the target [pixels].
    scale, angle : ndarray of float64, shape (frames,)
        Of the target; the angle clockwise [radians].
    look : ndarray of float64, shape (frames,)
        How far it has changed from its one look to its other, in [0, 1].
    still : Camera
        At the left end of its way.
    travel, nod : ndarray of float64, shape (frames,)
        Of the camera: along [metres], and down [pixels].
    gain : ndarray of float64, shape (frames,)
        Of the exposure.
    passages : tuple of Passage
        In order.
    """

    shot: Shot
    size: tuple[float, float]
    centre: Array
    scale: Array
    angle: Array
    look: Array
    still: Camera
    travel: Array
    nod: Array
    gain: Array
    passages: tuple[Passage, ...]

    @property
    def boxes(self) -> Array:
        """Around the target, turned or not, shape (frames, 4) [pixels]."""
        sides = self.scale[:, None] * self.size
        return np.concatenate([self.centre - sides / 2, sides], axis=1)


@lru_cache(maxsize=32)
def plan(seed: int, clip: int) -> Plan:
    """Plan of a clip of a set; clips count from 1."""
    shot = script(seed)[clip - 1]
    n = shot.frames
    random = part_generator(seed, f"nguyen2002/clip-{clip:02} plan")
    width = float(random.uniform(50, 70))
    size = width, float(np.clip(width * random.uniform(1.05, 1.35), 60, 85))
    scale = np.exp(_swinging(random, n, (3.0, 9.0), np.log(1 + random.uniform(0.05, 0.16))))
    angle = _swinging(random, n, (1.5, 6.0), np.radians(random.uniform(1.0, 3.5)))
    look = 0.5 + _swinging(random, n, (4.0, 12.0), 0.5)
    centre = np.stack(
        [
            SIZE[0] / 2 + _drifting(random, n, (3.0, 9.0), random.uniform(25, 75)),
            random.uniform(108, 132) + _drifting(random, n, (2.0, 7.0), random.uniform(5, 16)),
        ],
        axis=1,
    )
    centre += wandering(random, n, (0.3, 0.9), random.uniform(0.1, 0.5))[:, None] * [0.3, 1.0]
    gain = 1 + _swinging(random, n, (2.0, 8.0), random.uniform(0.03, 0.10))

    acts = _acts(random, shot, width)
    passed = [act.speed * width * float(scale.min()) for act in acts if HIDERS[act.kind].fixed]
    rate = _rate(random, passed)
    hand = wandering(random, n, (1.0, 4.0), random.uniform(0.3, 1.5))
    seen = rate * np.arange(n) + hand
    nod = quantised(wandering(random, n, (0.5, 3.0), random.uniform(0.2, 1.4)))
    still = Camera(700.0, 1.6, float(random.uniform(86, 104)), SIZE[0] / 2)
    passages = []
    for act in acts:
        hider, middle = HIDERS[act.kind], round(act.middle)
        side = width * scale[middle]
        own = -np.sign(rate) if hider.fixed else random.choice([-1.0, 1.0])
        speed = own * act.speed * side
        depth = speed / -rate if hider.fixed else 1.0
        x = speed * (np.arange(n) - act.middle) - depth * (hand - hand[middle])
        down = np.full(n, SIZE[1] / 2) if hider.tall else np.full(n, centre[middle, 1])
        tall = SIZE[1] + 40.0 if hider.tall else size[1] * float(scale[middle]) + 32
        if act.low:
            edge = centre[middle, 1] + (0.5 - act.low) * size[1] * scale[middle]
            tall = SIZE[1] + 20 - float(edge)
            down = np.full(n, edge + tall / 2)
        way = quantised(np.stack([centre[middle, 0] + x, down + nod - nod[middle]], axis=1))
        passages.append(Passage(act.kind, (act.width * side, tall), way))
    return Plan(
        shot, size, quantised(centre), scale, angle, look, still,
        quantised(seen - seen.min()) / NEAR, nod, gain, tuple(passages),
    )  # fmt: skip


@dataclass(frozen=True)
class _Act:
    """When something passes, and how; lengths are in widths of the target."""

    kind: str
    middle: float
    width: float
    speed: float
    low: float = 0.0


def _acts(random: np.random.Generator, shot: Shot, width: float) -> list[_Act]:
    """What passes, in order, with the spare time spread at random."""
    drawn = []
    for _ in range(shot.occlusions):
        kind = str(random.choice(SETTINGS[shot.setting].hiders))
        drawn.append((kind, random.uniform(*WIDTHS), random.uniform(*SPEEDS), 0.0))
    if shot.partial:
        fixed = [HIDERS[kind].fixed for kind, *_ in drawn]
        if random.random() < 0.5 and all(fixed):
            part = "post", random.uniform(0.15, 0.4), random.uniform(*SPEEDS), 0.0
        else:
            part = "heap", random.uniform(0.9, 1.4), SPEEDS[1], random.uniform(0.2, 0.4)
        drawn.insert(int(random.integers(len(drawn) + 1)), part)
    lasting = np.array([(1 + wide) / speed for _, wide, speed, _ in drawn])
    spare = shot.frames - LEAD - END - lasting.sum() - GAP * max(len(drawn) - 1, 0)
    shares = np.sort(random.uniform(0, max(spare, 0.0), len(drawn)))
    acts, start = [], float(LEAD)
    for (kind, wide, speed, low), length, share in zip(drawn, lasting, shares, strict=True):
        acts.append(_Act(kind, start + share + length / 2, wide, speed, low))
        start += length + GAP
    return acts


def _rate(random: np.random.Generator, passed: list[float]) -> float:
    """How fast the camera moves along, as seen in the target's plane [pixels/frame].

    What stands still and hides the target is nearer than this: it is `passed` faster.
    """
    side = float(random.choice([-1.0, 1.0]))
    if passed:
        return side * min(FASTEST, min(passed) / float(random.uniform(1.15, 1.7)))
    return side * float(
        random.choice([0.0, random.uniform(0.5, 2.0), random.uniform(2.0, FASTEST)])
    )


def _swinging(
    random: np.random.Generator, frames: int, periods: tuple[float, float], most: float
) -> Array:
    """Waves of random periods [seconds] that reach `most` at their farthest."""
    waves = wandering(random, frames, periods, 1.0)
    waves = waves - (waves.max() + waves.min()) / 2
    return np.asarray(waves * (most / np.abs(waves).max()))


def _drifting(
    random: np.random.Generator, frames: int, periods: tuple[float, float], most: float
) -> Array:
    """The same in pixels, less far where it would be too quick."""
    way = _swinging(random, frames, periods, most)
    return np.asarray(way * min(1.0, DRIFT / float(np.abs(np.diff(way)).max())))
