"""What the clips of a set are about: the figures that the paper gives of its own."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from datasets.synthetic.nguyen2002.film.settings import SETTINGS
from datasets.synthetic.nguyen2002.film.targets import KINDS
from datasets.synthetic.scene import part_generator

__all__ = ["CLIPS", "Shot", "script"]

CLIPS = 20

OCCLUSIONS = (0,) * 5 + (1,) * 10 + (2,) * 4 + (3,)
"""Complete ones by clip: 21 in 20 clips, as in the paper; how they are spread is ours."""

MEAN_FRAMES = 150
"""The paper's."""

SHORTEST, LONGEST = 110, 190

PARTIAL = 8
"""Clips in which something passes that hides a part of the target."""


@dataclass(frozen=True)
class Shot:
    """What a clip is about.

    Attributes
    ----------
    frames : int
    setting, target : str
        Names of `SETTINGS` and `KINDS`.
    occlusions : int
        Complete ones.
    partial : bool
        Whether something passes besides that hides a part of the target.
    """

    frames: int
    setting: str
    target: str
    occlusions: int
    partial: bool


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
