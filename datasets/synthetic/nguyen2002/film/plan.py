"""Plan of a clip: setting, target, paths of target and camera, occluders and light.

The total numbers of frames and of occlusions in a set of clips are those of the paper.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nguyen2002.film.occluders import OCCLUDERS
from trackmark.datasets.synthetic.nguyen2002.film.props import CARRIERS
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.views import Viewpoint, random_wander
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

SIZE = 320, 240
EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
# scale at the depth of the target [pixels/metre]
NEAR = 45.0
EYE = 1.6  # height of the camera above the ground [metres]
FASTEST = 5.0  # maximum speed of the camera, measured at the depth of the target [pixels/frame]
# maximum speed of the target in the image, horizontal and vertical, as the camera follows
# [pixels/frame]
DRIFT = 3.0

CLIPS = 20
# complete occlusions per clip: 21 in 20 clips, as in the paper; their distribution is our choice
OCCLUSIONS = (0,) * 5 + (1,) * 10 + (2,) * 4 + (3,)
MEAN_FRAMES = 150  # mean number of frames per clip, as in the paper
SHORTEST, LONGEST = 110, 190
PARTIAL = 8  # number of clips with an object that occludes only a part of the target
# minimum number of frames before the first, between consecutive, and after the last occluder
LEAD, GAP, END = 16, 12, 20
WIDTHS = 2.1, 3.0  # range of the width of objects that occlude the whole target [target widths]
SPEEDS = 0.08, 0.15  # range of the speed of occluders in the image [target widths/frame]
# Maximum number of frames in which more than a quarter of the target is occluded. The paper limits
# an occlusion to L frames, 35 in its list of the frames that it visits.
LONGEST_OCCLUSION = 33


@dataclass(frozen=True)
class Shot:
    """Setting, target and number of occlusions of a clip."""

    frames: int
    setting: str  # name in `SETTINGS`
    target: str  # name in `KINDS`
    occlusions: int  # number of complete occlusions
    partial: bool  # True if one more object occludes a part of the target


@lru_cache(maxsize=4)
def clip_script(seed: int) -> tuple[Shot, ...]:
    """Return setting, target and number of occlusions of each clip of a set."""
    random = part_generator(seed, "nguyen2002/clip script")
    occlusions = random.permutation(OCCLUSIONS)
    frames = _lengths(random, occlusions)
    settings = random.permutation([list(SETTINGS)[k % len(SETTINGS)] for k in range(CLIPS)])
    calm = random.permutation(np.flatnonzero(occlusions < 2))[:PARTIAL]
    # About half of the targets in every setting are ellipses.
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
    """Return the number of frames of each clip, with the mean of the paper."""
    least = np.array([SHORTEST, SHORTEST, 140, 175])[occlusions]
    frames = random.integers(least, LONGEST + 1)
    # Lengthen or shorten random clips until the mean is the paper's.
    while (excess := int(frames.sum()) - CLIPS * MEAN_FRAMES) != 0:
        clip = int(random.integers(CLIPS))
        frames[clip] = np.clip(frames[clip] - np.sign(excess), least[clip], LONGEST)
    return frames


@dataclass(frozen=True)
class Passage:
    """Object that passes in front of the target, and its path."""

    kind: str  # name in `occluders.OCCLUDERS`
    size: tuple[float, float]  # width and height of the object [pixels]
    path: Array  # (frames, 2): positions of its anchor [pixels]


@dataclass(frozen=True)
class ClipPlan:
    """Plan of a clip; nothing is painted yet."""

    shot: Shot
    size: tuple[float, float]  # width and height of the target at scale 1 [pixels]
    centre: Array  # (frames, 2): of the target [pixels]
    scale: Array  # (frames,): of the target
    angle: Array  # (frames,): of the target, clockwise [radians]
    look: Array  # (frames,): share of the target's second texture in the mixture of two, in [0, 1]
    still: Viewpoint  # the camera at the left end of its path
    travel: Array  # (frames,): travel of the camera along its path [metres]
    nod: Array  # (frames,): vertical shift of the image by the camera, downwards [pixels]
    ground: Array  # (frames,): row of the ground below the target [pixels]
    gain: Array  # (frames,): of the exposure
    passages: tuple[Passage, ...]  # in order

    @property
    def boxes(self) -> Array:
        """Boxes around the untilted target, shape (frames, 4) [pixels]."""
        sides = self.scale[:, None] * self.size
        return np.concatenate([self.centre - sides / 2, sides], axis=1)


@lru_cache(maxsize=32)
def clip_plan(seed: int, clip: int) -> ClipPlan:
    """Return the plan of clip `number`, which counts from 1, of a set."""
    shot = clip_script(seed)[clip - 1]
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

    acts = _sample_passages(random, shot, width)
    static_speeds = [
        act.speed * width * float(scale.min()) for act in acts if OCCLUDERS[act.kind].fixed
    ]
    rate = _sample_camera_speed(random, static_speeds)
    hand = random_wander(random, n, (1.0, 4.0), random.uniform(0.3, 1.5))
    seen = rate * np.arange(n) + hand
    passages = []
    for act in acts:
        hider, middle = OCCLUDERS[act.kind], round(act.middle)
        side = width * scale[middle]
        direction = -np.sign(rate) if hider.fixed else random.choice([-1.0, 1.0])
        speed = direction * act.speed * side
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
        path = quantised(np.stack([centre[middle, 0] + x, down + nod - nod[middle]], axis=1))
        passages.append(Passage(act.kind, (act.width * side, tall), path))
    return ClipPlan(
        shot, size, quantised(centre), scale, angle, look, still,
        quantised(seen - seen.min()) / NEAR, nod, ground, gain, tuple(passages),
    )  # fmt: skip


@dataclass(frozen=True)
class _PassageSample:
    """Time, kind and speed of an occluder's passage; lengths are in target widths."""

    kind: str
    middle: float
    width: float
    speed: float
    low: float = 0.0


def _sample_passages(random: np.random.Generator, shot: Shot, width: float) -> list[_PassageSample]:
    """Sample the passages of a clip in order of time, at random times that keep their distances."""
    samples = []
    for _ in range(shot.occlusions):
        kind = str(random.choice(SETTINGS[shot.setting].occluders))
        wide = random.uniform(*WIDTHS)
        slowest = max(SPEEDS[0], (wide + 0.5) / LONGEST_OCCLUSION)
        samples.append((kind, wide, random.uniform(slowest, SPEEDS[1]), 0.0))
    if shot.partial:
        fixed = [OCCLUDERS[kind].fixed for kind, *_ in samples]
        if random.random() < 0.5 and all(fixed):
            part = "post", random.uniform(0.15, 0.4), random.uniform(*SPEEDS), 0.0
        else:
            part = "heap", random.uniform(0.9, 1.4), SPEEDS[1], random.uniform(0.2, 0.4)
        samples.insert(int(random.integers(len(samples) + 1)), part)
    lasting = np.array([(1 + wide) / speed for _, wide, speed, _ in samples])
    spare = shot.frames - LEAD - END - lasting.sum() - GAP * max(len(samples) - 1, 0)
    shares = np.sort(random.uniform(0, max(spare, 0.0), len(samples)))
    acts, start = [], float(LEAD)
    for (kind, wide, speed, low), length, share in zip(samples, lasting, shares, strict=True):
        acts.append(_PassageSample(kind, start + share + length / 2, wide, speed, low))
        start += length + GAP
    return acts


def _sample_camera_speed(random: np.random.Generator, static_speeds: list[float]) -> float:
    """Sample the camera's speed at the target's depth, below `static_speeds` [pixels/frame]."""
    side = float(random.choice([-1.0, 1.0]))
    if static_speeds:
        return side * min(FASTEST, min(static_speeds) / float(random.uniform(1.15, 1.7)))
    return side * float(
        random.choice([0.0, random.uniform(0.5, 2.0), random.uniform(2.0, FASTEST)])
    )


def _swinging(
    random: np.random.Generator, frames: int, periods: tuple[float, float], most: float
) -> Array:
    """Return a sum of waves with random periods [seconds], scaled to the maximum `most`."""
    waves = random_wander(random, frames, periods, 1.0)
    waves = waves - (waves.max() + waves.min()) / 2
    return np.asarray(waves * (most / np.abs(waves).max()))


def _drifting(
    random: np.random.Generator, frames: int, periods: tuple[float, float], most: float
) -> Array:
    """Return a sum of waves [pixels] whose speed does not exceed `DRIFT`."""
    path = _swinging(random, frames, periods, most)
    return np.asarray(path * min(1.0, DRIFT / float(np.abs(np.diff(path)).max())))
