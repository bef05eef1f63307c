"""When what happens, and where: the object's way, who passes before it, the lamp."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.render.path import Loop, quantised, random_loop

Array = NDArray[np.float64]

FRAMES = 300
SIZE = 320, 240
KINDS = "board", "door", "cloth", "back"

# About when something is right before the object: with both lamps, with one, with both again.
CROSSINGS = (60, 166, 252)
OFF, ON = 110, 215  # about when a lamp goes off, and on again: far from all of these


@dataclass(frozen=True)
class Passing:
    """Something that passes before the object."""

    kind: str  # of `KINDS`: a wooden board, a panelled door, a patterned cloth, somebody's back
    middle: float  # when its middle is before the object's [frames]
    pace: float  # to the right [pixels/frame]


@dataclass(frozen=True)
class LightsPlan:
    """The course of events."""

    loop: Loop  # way of the object's middle [pixels]
    waves: Array  # (4, 3): of its scale, tilt, turn and nod: size, period [frames], phase
    passings: tuple[Passing, ...]  # in order of time
    off: int  # first frame without the lamp
    on: int  # first frame with it again

    def place(self, times: ArrayLike) -> Array:
        """Where the object's middle is [pixels], shape `times.shape + (2,)`."""
        return quantised(self.loop.at(times))

    def scale(self, times: ArrayLike) -> Array:
        """Size of the object, about 1."""
        return 1 + self._wave(0, times)

    def tilt(self, times: ArrayLike) -> Array:
        """How far it leans to the right [radians]."""
        return self._wave(1, times)

    def facing(self, times: ArrayLike) -> Array:
        """How far it faces to the right and down [radians], shape `times.shape + (2,)`."""
        return np.stack([self._wave(2, times), self._wave(3, times)], axis=-1)

    def passer(self, passing: Passing, times: ArrayLike) -> Array:
        """Column in which the middle of what passes is [pixels]."""
        since = np.asarray(times, np.float64) - passing.middle
        return quantised(self.place(passing.middle)[0] + passing.pace * since)

    def lit(self, frame: int) -> bool:
        """Whether the lamp that goes off is on."""
        return not self.off <= frame < self.on

    def _wave(self, row: int, times: ArrayLike) -> Array:
        size, period, phase = self.waves[row]
        return np.asarray(size * np.sin(2 * np.pi * np.asarray(times) / period + phase))


def drawn_plan(random: np.random.Generator) -> LightsPlan:
    """A course of events, drawn at random."""
    loop = random_loop(random, (70, 66), (250, 150), random.uniform(1.2, 1.7))
    sizes = (0.06, 0.11), (0.010, 0.025), (0.05, 0.12), (0.03, 0.08)
    waves = [
        [random.uniform(*size), random.uniform(110, 210), random.uniform(0, 2 * np.pi)]
        for size in sizes
    ]
    kinds = random.permutation(KINDS)[: len(CROSSINGS)].tolist()
    passings = []
    for kind, about in zip(kinds, CROSSINGS, strict=True):
        middle, side = about + random.uniform(-5, 5), float(random.choice([-1, 1]))
        pace = side * random.uniform(6.5, 8.0) * (1.3 if kind == "back" else 1)
        passings.append(Passing(kind, middle, pace))
    off, on = (at + int(random.integers(-4, 5)) for at in (OFF, ON))
    return LightsPlan(loop, np.array(waves), tuple(passings), off, on)
