"""Section 3: a point with a one-dimensional position and a one-dimensional colour.

Both are cues in the framework of the tracker (`trackers.contours.chain`). With dependent cues each
position is weighted together with a colour that is drawn by the weights of the colour filter; with
independent cues the colour is drawn uniformly. The paper prints one parameter, λ = 1. The other
parameters (`SET_B`) were chosen before a filter ran.
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
"""Numbers of samples at the ticks of Fig. 2."""

POSITION, COLOUR = 0, 1  # (position, colour): a state, an observation or deviations
DECAY = 0.95  # σ_pos and σ_col: share of the deviation from the middle that remains after a frame
POSITIONS, COLOURS = (-1.0, 1.0), (0.0, 1.0)
_MIDDLES = np.array([0.0, 0.5])
_STARTS = np.array([[-0.5, 0.25], [0.5, 0.75]])  # smallest and largest


@dataclass(frozen=True)
class Setting:
    """Parameters of the example; pairs are standard deviations of position and colour."""

    scale: float  # λ, the distance over which a weight falls to 1/e
    noise: tuple[float, float]  # of the true steps
    observed: tuple[float, float]  # of the observation
    dynamics: tuple[float, float]  # of the filters' random walk


SET_B = Setting(1.0, (0.1, 0.05), (0.3, 0.3), (0.1, 0.05))
"""Printed λ, and observations of medium accuracy."""


class Trajectory(NamedTuple):
    """Position and colour of the point: before the first frame, then by frame (frames, 2)."""

    start: Array
    truth: Array
    observed: Array


def trajectory(setting: Setting, n_frames: int, generator: np.random.Generator) -> Trajectory:
    """Draw a bounded random trajectory: both features return to the middle, with noise."""
    start = generator.uniform(*_STARTS)
    truth = np.empty((n_frames, 2))
    state = start
    for frame, steps in enumerate(generator.normal(0.0, setting.noise, (n_frames, 2))):
        # (x - μ) σ + N(μ_noise, σ_noise) with μ_noise = μ
        state = (state - _MIDDLES) * DECAY + _MIDDLES + steps
        state = np.clip(state, *np.transpose([POSITIONS, COLOURS]))
        truth[frame] = state
    return Trajectory(start, truth, truth + generator.normal(0.0, setting.observed, (n_frames, 2)))


class Feature(ParticleCue):
    """Cue with a random walk of position or colour, weighted by exp(-d / λ).

    d is the distance to the observed value (PF1). For a position with an attached colour, d also
    includes the distance of this colour (PF2). An observation is a pair of position and colour.
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
    """Cue that gives all colours equal probability."""

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
        """See `Cue.receive`. This cue has no state."""


def chain(filter_name: Filter, setting: Setting, n_samples: int, start: Array) -> Chain:
    """Return the chain of cues at the known start of a trajectory: colour first, position last.

    Independent cues have a third cue between them that gives each position a uniform colour.
    """
    colour, position = (
        Feature(quantity, start, n_samples, setting) for quantity in (COLOUR, POSITION)
    )
    if filter_name == "independent":
        return Chain([colour, AnyColour(n_samples), position])
    return Chain([colour, position], "by-weight")


def estimates(
    filter_name: Filter,
    setting: Setting,
    n_samples: int,
    seen: Trajectory,
    generator: np.random.Generator,
) -> Array:
    """Return the weighted means of position and attached colour by frame, shape (frames, 2)."""
    cues = chain(filter_name, setting, n_samples, seen.start)
    rows = []
    for observation in seen.observed:
        hypotheses = cues.step(observation, generator)
        before, last = hypotheses[-2], hypotheses[-1]
        colour = before.states[last.attached]
        rows.append((last.weights @ last.states, last.weights @ colour))
    return np.array(rows)


@cache
def errors(run: int, n_samples: int) -> dict[str, float]:
    """Return the mean Euclidean error of (position, colour) over a trajectory, by filter.

    `run` is the number of the trajectory. All filters have the same ground truth, the same
    observations and `n_samples` samples. The result also has the error of the `observation`.
    """
    seen = trajectory(SET_B, FRAMES, np.random.default_rng([run]))
    series = {"observation": seen.observed}
    for index, filter_name in enumerate(FILTERS):
        generator = np.random.default_rng([run, n_samples, index])
        series[filter_name] = estimates(filter_name, SET_B, n_samples, seen, generator)
    return {
        name: float(np.hypot(*(values - seen.truth).T).mean()) for name, values in series.items()
    }


@measure("share of observation's error")
def gain_of_dependence(run: str) -> float:
    """Return the error with independent cues minus that with dependent ones (Fig. 2).

    The errors are averaged over 50 to 500 samples and divided by the observation's error.
    """
    errors_by_number = [errors(int(run), number) for number in NUMBERS]
    gains = [error["independent"] - error["dependent"] for error in errors_by_number]
    return float(np.mean(gains) / errors_by_number[0]["observation"])


@measure("share of observation's error")
def gain_of_filtering(run: str) -> float:
    """Return the observation's error minus the larger error of both filters.

    Averaged as in `gain_of_dependence`.
    """
    errors_by_number = [errors(int(run), number) for number in NUMBERS]
    means = [np.mean([error[kind] for error in errors_by_number]) for kind in FILTERS]
    return float(1 - max(means) / errors_by_number[0]["observation"])
