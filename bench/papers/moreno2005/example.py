"""Section 3: a point that changes its position and its colour in one dimension each.

Both are cues of the tracker's own framework (`trackers.contours.chain`), so that the example and
the tracker share what makes features dependent. Dependent, every position is weighted with a colour
drawn by the weights of the colour filter; independent, with one drawn evenly from all colours. The
paper prints one parameter, λ = 1; the others of set B are ours, chosen before a filter ran.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.measures import measure
from trackmark.trackers.contours.chain import Chain, Hypotheses, ParticleCue, Weighed

Array: TypeAlias = NDArray[np.float64]
Attached: TypeAlias = NDArray[np.intp] | None
Earlier: TypeAlias = Sequence[Hypotheses]
Filter: TypeAlias = Literal["independent", "dependent"]

FILTERS: tuple[Filter, ...] = ("independent", "dependent")
FRAMES = 100
NUMBERS = tuple(range(50, 501, 50))
"""Numbers of samples: the ticks of Fig. 2."""

POSITION, COLOUR = 0, 1  # in pairs: of a state, of an observation, of deviations
DECAY = 0.95  # σ_pos and σ_col: what is left of a deviation from the middle per frame
POSITIONS, COLOURS = (-1.0, 1.0), (0.0, 1.0)
_MIDDLES = np.array([0.0, 0.5])
_STARTS = np.array([[-0.5, 0.25], [0.5, 0.75]])  # smallest and largest


@dataclass(frozen=True)
class Setting:
    """Parameters of the example; pairs are of position and colour.

    Attributes
    ----------
    scale : float
        λ, the distance over which a weight falls to 1/e.
    noise, observed, dynamics : pair of float
        Deviations of the truth's steps, of the observation, and of the filters' random walk.
    """

    scale: float
    noise: tuple[float, float]
    observed: tuple[float, float]
    dynamics: tuple[float, float]


SET_B = Setting(1.0, (0.1, 0.05), (0.3, 0.3), (0.1, 0.05))
"""The printed λ with observations of middling accuracy."""


class Trajectory(NamedTuple):
    """Trajectory of the point, position and colour: before the first frame, then (frames, 2)."""

    start: Array
    truth: Array
    observed: Array


def trajectory(setting: Setting, frames: int, generator: np.random.Generator) -> Trajectory:
    """Draw a trajectory: both features return to the middle and are moved at random, in bounds."""
    start = generator.uniform(*_STARTS)
    truth = np.empty((frames, 2))
    state = start
    for frame, steps in enumerate(generator.normal(0.0, setting.noise, (frames, 2))):
        # (x - μ) σ + N(μ_noise, σ_noise) with μ_noise = μ
        state = (state - _MIDDLES) * DECAY + _MIDDLES + steps
        state = np.clip(state, *np.transpose([POSITIONS, COLOURS]))
        truth[frame] = state
    return Trajectory(start, truth, truth + generator.normal(0.0, setting.observed, (frames, 2)))


class Feature(ParticleCue):
    """A random walk of position or colour, weighted by exp(-d / λ).

    d is the distance to the observed value (PF1), plus, for a position with a colour attached, the
    distance of this colour (PF2). An observation is a pair of position and colour.
    """

    def __init__(self, which: int, start: Array, samples: int, setting: Setting) -> None:
        super().__init__(np.array(start[which]), samples)
        self._which, self._scale = which, setting.scale
        self._spread = setting.dynamics[which]

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        return states + self._spread * generator.standard_normal(len(states))

    def weigh(
        self, observation: Array, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        far = np.abs(states - observation[self._which])
        if attached is not None:
            far = np.abs(earlier[-1].states[attached] - observation[COLOUR]) + far
        return Weighed(np.exp(-far / self._scale))


class AnyColour:
    """No knowledge of the colour: all colours are equally likely."""

    def __init__(self, samples: int) -> None:
        self._samples = samples

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`."""
        low, high = COLOURS
        return low + (high - low) * generator.random(self._samples)

    def weigh(
        self, observation: Array, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        return Weighed(np.ones(len(states)))

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`: it learns nothing."""


def chain(kind: Filter, setting: Setting, samples: int, start: Array) -> Chain[Array]:
    """Return the cues at the known beginning of a trajectory: colour first, position last.

    Independent cues have one between them that gives positions any colour.
    """
    colour, position = (
        Feature(quantity, start, samples, setting) for quantity in (COLOUR, POSITION)
    )
    if kind == "independent":
        return Chain([colour, AnyColour(samples), position])
    return Chain([colour, position], "by-weight")


def estimates(
    kind: Filter, setting: Setting, samples: int, seen: Trajectory, generator: np.random.Generator
) -> Array:
    """Follow a trajectory; return weighted means of position and attached colour, (frames, 2)."""
    cues = chain(kind, setting, samples, seen.start)
    rows = []
    for observation in seen.observed:
        hypotheses = cues.step(observation, generator)
        before, last = hypotheses[-2], hypotheses[-1]
        colour = before.states[last.attached]
        rows.append((last.weights @ last.states, last.weights @ colour))
    return np.array(rows)


@cache
def errors(run: int, number: int) -> dict[str, float]:
    """Return the mean Euclidean error of (position, colour) over a trajectory.

    Parameters
    ----------
    run : int
        Number of the trajectory; all filters have the same ground truth and observations.
    number : int
        Number of samples.

    Returns
    -------
    dict of str to float
        Error of the `observation` and of the filters, by name.
    """
    seen = trajectory(SET_B, FRAMES, np.random.default_rng([run]))
    series = {"observation": seen.observed}
    for place, kind in enumerate(FILTERS):
        generator = np.random.default_rng([run, number, place])
        series[kind] = estimates(kind, SET_B, number, seen, generator)
    return {
        name: float(np.hypot(*(values - seen.truth).T).mean()) for name, values in series.items()
    }


@measure("of the observation's error")
def gain_of_dependence(run: str) -> float:
    """Return the error with independent cues minus that with dependent ones (Fig. 2).

    Averaged over 50 to 500 samples, as a share of the observation's error.
    """
    errors_by_number = [errors(int(run), number) for number in NUMBERS]
    gains = [error["independent"] - error["dependent"] for error in errors_by_number]
    return float(np.mean(gains) / errors_by_number[0]["observation"])


@measure("of the observation's error")
def gain_of_filtering(run: str) -> float:
    """Return the observation's error minus the larger error of both filters.

    Averaged as in `gain_of_dependence`.
    """
    errors_by_number = [errors(int(run), number) for number in NUMBERS]
    means = [np.mean([error[kind] for error in errors_by_number]) for kind in FILTERS]
    return float(1 - max(means) / errors_by_number[0]["observation"])
