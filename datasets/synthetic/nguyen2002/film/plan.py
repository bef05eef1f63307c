"""What happens in a clip: what it is about, ways of target and camera, what passes when, light.

What the clips of a set are about has the figures that the paper gives of its own.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nguyen2002.film.hiders import HIDERS
from trackmark.datasets.synthetic.nguyen2002.film.props import CARRIERS
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.views import Viewpoint, random_wander
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

SIZE = 320, 240
EXPOSURE = 0.5  # part of the time between two frames for which the shutter is open
# Of the target's plane [pixels/metre]: the camera's travel in metres is seen as large there.
NEAR = 45.0
EYE = 1.6  # height of the camera above the ground [metres]
FASTEST = 5.0  # of the camera that moves along, in the target's plane [pixels/frame]
# Of the target at most, across the picture and down, as the camera follows it [pixels/frame].
DRIFT = 3.0

CLIPS = 20
# Complete ones by clip: 21 in 20 clips, as in the paper; how they are spread is ours.
OCCLUSIONS = (0,) * 5 + (1,) * 10 + (2,) * 4 + (3,)
MEAN_FRAMES = 150  # the paper's
SHORTEST, LONGEST = 110, 190
PARTIAL = 8  # clips in which something passes that hides a part of the target
# Frames, at least, before anything passes, between two that pass, and after the last.
LEAD, GAP, END = 16, 12, 20
WIDTHS = 2.1, 3.0  # of what hides all of the target [the target's width]
SPEEDS = 0.08, 0.15  # of what passes, across the picture [the target's width a frame]
# Frames in which more than a quarter of the target is hidden, at most: the paper limits an
# occlusion to L frames, 35 in its list of the frames that it visits.
LONGEST_OCCLUSION = 33


@dataclass(frozen=True)
class Shot:
    """What a clip is about."""

    frames: int
    setting: str  # name of `SETTINGS`
    target: str  # name of `KINDS`
    occlusions: int  # complete ones
    partial: bool  # whether something passes besides that hides a part of the target


@lru_cache(maxsize=4)
def script(seed: int) -> tuple[Shot, ...]:
    """The clips of a set, in order."""
    random = part_generator(seed, "nguyen2002/clip script")
    occlusions = random.permutation(OCCLUSIONS)
    frames = _lengths(random, occlusions)
    settings = random.permutation([list(SETTINGS)[k % len(SETTINGS)] for k in range(CLIPS)])
    calm = random.permutation(np.flatnonzero(occlusions < 2))[:PARTIAL]
    # Half of the targets are ellipses, in every setting about as many.
    turn = {name: int(random.integers(2)) for name in SETTINGS}
    shots = []
    for clip in range(CLIPS):
        setting = str(settings[clip])
        turn[setting] += 1
        is_round = turn[setting] % 2 == 0
        kinds = [kind for kind in SETTINGS[setting].targets if KINDS[kind].round == is_round]
        target = kinds[int(random.integers(len(kinds)))]
        shots.append(Shot(int(frames[clip]), setting, target, int(occlusions[clip]), clip in calm))
    return tuple(shots)


def _lengths(
    random: np.random.Generator, occlusions: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Frames of each clip: of the paper's mean, long enough for what happens in it."""
    least = np.array([SHORTEST, SHORTEST, 140, 175])[occlusions]
    frames = random.integers(least, LONGEST + 1)
    # Whoever has some to spare gives, or takes, until the mean is right.
    while (excess := int(frames.sum()) - CLIPS * MEAN_FRAMES) != 0:
        clip = int(random.integers(CLIPS))
        frames[clip] = np.clip(frames[clip] - np.sign(excess), least[clip], LONGEST)
    return frames


@dataclass(frozen=True)
class Passage:
    """Something that passes before the target."""

    kind: str  # name of `hiders.HIDERS`
    size: tuple[float, float]  # width and height of what hides [pixels]
    way: Array  # (frames, 2): of its anchor [pixels]


@dataclass(frozen=True)
class ClipPlan:
    """A clip before anything is painted."""

    shot: Shot
    size: tuple[float, float]  # width and height of the target at scale 1 [pixels]
    centre: Array  # (frames, 2): of the target [pixels]
    scale: Array  # (frames,): of the target
    angle: Array  # (frames,): of the target, clockwise [radians]
    look: Array  # (frames,): how far it has changed from its one look to its other, in [0, 1]
    still: Viewpoint  # at the left end of its way
    travel: Array  # (frames,): of the camera, along [metres]
    nod: Array  # (frames,): of the camera, down [pixels]
    ground: Array  # (frames,): row in which the ground is below the target [pixels]
    gain: Array  # (frames,): of the exposure
    passages: tuple[Passage, ...]  # in order

    @property
    def boxes(self) -> Array:
        """Around the target, turned or not, shape (frames, 4) [pixels]."""
        sides = self.scale[:, None] * self.size
        return np.concatenate([self.centre - sides / 2, sides], axis=1)


@lru_cache(maxsize=32)
def plan(seed: int, clip: int) -> ClipPlan:
    """Plan of a clip of a set; clips count from 1."""
    shot = script(seed)[clip - 1]
    n = shot.frames
    random = part_generator(seed, f"nguyen2002/clip-{clip:02} plan")
    width = float(random.uniform(50, 70))
    size = width, float(np.clip(width * random.uniform(1.05, 1.35), 60, 85))
    scale = np.exp(_swinging(random, n, (3.0, 9.0), np.log(1 + random.uniform(0.05, 0.16))))
    angle = _swinging(random, n, (1.5, 6.0), np.radians(random.uniform(1.0, 3.5)))
    look = 0.5 + _swinging(random, n, (4.0, 12.0), 0.5)
    across = SIZE[0] / 2 + _drifting(random, n, (3.0, 9.0), random.uniform(25, 75))
    still = Viewpoint(700.0, EYE, float(random.uniform(86, 104)), SIZE[0] / 2)
    tilt = _drifting(random, n, (2.0, 7.0), random.uniform(4, 12))
    nod = quantised(tilt + random_wander(random, n, (0.5, 3.0), random.uniform(0.2, 1.4)))
    ground = still.horizon + nod + EYE * NEAR * scale
    drop = CARRIERS[KINDS[shot.target].carrier].drop
    level = ground - drop * size[1] * scale if drop else still.horizon + nod + 26
    centre = np.stack([across, level], axis=1)
    centre += random_wander(random, n, (0.3, 0.9), random.uniform(0.1, 0.5))[:, None] * [0.3, 0.6]
    gain = 1 + _swinging(random, n, (2.0, 8.0), random.uniform(0.03, 0.10))

    acts = _acts(random, shot, width)
    passed = [act.speed * width * float(scale.min()) for act in acts if HIDERS[act.kind].fixed]
    rate = _rate(random, passed)
    hand = random_wander(random, n, (1.0, 4.0), random.uniform(0.3, 1.5))
    seen = rate * np.arange(n) + hand
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
        if hider.stands:
            below = ground[middle] if drop else SIZE[1]
            tall = max(tall, 2 * float(below - centre[middle, 1]) - 36)
        if act.low:
            edge = centre[middle, 1] + (0.5 - act.low) * size[1] * scale[middle]
            tall = SIZE[1] + 20 - float(edge)
            down = np.full(n, edge + tall / 2)
        way = quantised(np.stack([centre[middle, 0] + x, down + nod - nod[middle]], axis=1))
        passages.append(Passage(act.kind, (act.width * side, tall), way))
    return ClipPlan(
        shot, size, quantised(centre), scale, angle, look, still,
        quantised(seen - seen.min()) / NEAR, nod, ground, gain, tuple(passages),
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
        wide = random.uniform(*WIDTHS)
        slowest = max(SPEEDS[0], (wide + 0.5) / LONGEST_OCCLUSION)
        drawn.append((kind, wide, random.uniform(slowest, SPEEDS[1]), 0.0))
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
    waves = random_wander(random, frames, periods, 1.0)
    waves = waves - (waves.max() + waves.min()) / 2
    return np.asarray(waves * (most / np.abs(waves).max()))


def _drifting(
    random: np.random.Generator, frames: int, periods: tuple[float, float], most: float
) -> Array:
    """The same in pixels, less far where it would be too quick."""
    way = _swinging(random, frames, periods, most)
    return np.asarray(way * min(1.0, DRIFT / float(np.abs(np.diff(way)).max())))
