"""The two cues of section 3, in the framework of the tracker."""

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.papers.moreno2005.one_dimensional.settings import COLOURS, Course, Setting
from trackers.contours.cues.chain import Chain, Hypotheses, Weighed
from trackers.contours.cues.particles import ParticleCue

__all__ = ["FILTERS", "Filter", "chain", "estimates"]

Array: TypeAlias = NDArray[np.float64]
Filter: TypeAlias = Literal["independent", "dependent", "unweighted"]

FILTERS: tuple[Filter, ...] = ("independent", "dependent", "unweighted")


class _Walk(ParticleCue):
    """A random walk of one number; `spread` is the deviation of a step."""

    def __init__(self, start: float, samples: int, scale: float, spread: float) -> None:
        super().__init__(np.array(start), samples)
        self._scale, self._spread = scale, spread

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        return states + self._spread * generator.standard_normal(len(states))


class Colour(_Walk):
    """PF1: a random walk, weighed by exp(-|s₁ - observed colour| / λ)."""

    def __init__(self, start: float, samples: int, setting: Setting) -> None:
        super().__init__(start, samples, setting.scale, setting.dynamics[1])

    def weigh(
        self,
        observation: Array,
        states: Array,
        attached: NDArray[np.intp] | None,
        earlier: Sequence[Hypotheses],
    ) -> Weighed:
        """See `Cue.weigh`; an observation is a pair of position and colour, as for all here."""
        return Weighed(np.exp(-np.abs(states - observation[1]) / self._scale))


class AnyColour:
    """No knowledge of the colour: all are equally likely, before the frame and after it."""

    def __init__(self, samples: int) -> None:
        self._samples = samples

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`."""
        low, high = COLOURS
        return low + (high - low) * generator.random(self._samples)

    def weigh(
        self,
        observation: Array,
        states: Array,
        attached: NDArray[np.intp] | None,
        earlier: Sequence[Hypotheses],
    ) -> Weighed:
        """See `Cue.weigh`."""
        return Weighed(np.ones(len(states)))

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`: nothing is learnt."""


class Position(_Walk):
    """PF2: weighed by exp(-(|s₁ - observed colour| + |s₂ - observed position|) / λ)."""

    def __init__(self, start: float, samples: int, setting: Setting) -> None:
        super().__init__(start, samples, setting.scale, setting.dynamics[0])

    def weigh(
        self,
        observation: Array,
        states: Array,
        attached: NDArray[np.intp] | None,
        earlier: Sequence[Hypotheses],
    ) -> Weighed:
        """See `Cue.weigh`; s₁ is the colour attached."""
        colours = earlier[-1].states[attached]
        far = np.abs(colours - observation[1]) + np.abs(states - observation[0])
        return Weighed(np.exp(-far / self._scale))


def chain(kind: Filter, setting: Setting, samples: int, start: Array) -> Chain[Array]:
    """Cues at the beginning of a course, which is known.

    The colour filter is the first and position the last. Between them, where they are independent,
    stands what gives positions any colour.
    """
    colour, position = Colour(start[1], samples, setting), Position(start[0], samples, setting)
    if kind == "independent":
        return Chain([colour, AnyColour(samples), position])
    return Chain([colour, position], "by-weight" if kind == "dependent" else "uniform")


def estimates(
    kind: Filter, setting: Setting, samples: int, seen: Course, generator: np.random.Generator
) -> Array:
    """Follow a course.

    Returns
    -------
    ndarray of float64, shape (n, 4)
        By frame: Σ π₂ s₂, Σ π₂ s₁ of the colours attached, Σ π₁ s₁ of the colour filter, and the
        effective sample size of the positions as a share of their number.
    """
    cues = chain(kind, setting, samples, seen.start)
    rows = []
    for observation in seen.observed:
        found = cues.step(observation, generator)
        first, before, last = found[0], found[-2], found[-1]
        rows.append(
            (
                last.weights @ last.states,
                last.weights @ before.states[last.attached],
                first.weights @ first.states,
                1 / (samples * (last.weights @ last.weights)),
            )
        )
    return np.array(rows)
