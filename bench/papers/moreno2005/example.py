"""Section 3: a point that changes position and colour in one dimension each.

Both are cues of the tracker's own framework (`trackers.contours.chain`), so that example and
tracker share what makes features dependent. What the paper calls dependent attaches to every
position a colour drawn by the weights of the colour filter; independent, one drawn evenly from all
of the space of colours. A third way, not in the paper, tells two effects apart: `unweighted`
attaches colours of the filter whatever their weights. Of the parameters the paper gives one: λ = 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.contours.chain import Chain, Hypotheses, ParticleCue, Weighed

__all__ = [
    "COLOURS",
    "FILTERS",
    "FRAMES",
    "NUMBERS",
    "POSITIONS",
    "SETTINGS",
    "Course",
    "Filter",
    "Setting",
    "chain",
    "course",
    "estimates",
]

Array: TypeAlias = NDArray[np.float64]
Attached: TypeAlias = NDArray[np.intp] | None
Earlier: TypeAlias = Sequence[Hypotheses]
Filter: TypeAlias = Literal["independent", "dependent", "unweighted"]

FILTERS: tuple[Filter, ...] = ("independent", "dependent", "unweighted")

FRAMES = 100
NUMBERS = (5, 10, 20, *range(50, 501, 50))
"""Numbers of samples: the ticks of Fig. 2, and fewer."""

POSITION, COLOUR = 0, 1  # in pairs: of a state, of what is observed, of deviations

DECAY = 0.95  # σ_pos and σ_col: what is left of a deviation from the middle, a frame
POSITIONS, COLOURS = (-1.0, 1.0), (0.0, 1.0)
_MIDDLES = np.array([0.0, 0.5])
_STARTS = np.array([[-0.5, 0.25], [0.5, 0.75]])  # least and most


@dataclass(frozen=True)
class Setting:
    """A set of parameters; pairs are of position and colour.

    Attributes
    ----------
    scale : float
        λ: the distance over which a weight falls to 1/e.
    noise : tuple of float
        Deviation of the truth's steps.
    observed : tuple of float
        Deviation of what is observed from the truth.
    dynamics : tuple of float
        Deviation of the filters' random walk.
    """

    scale: float
    noise: tuple[float, float]
    observed: tuple[float, float]
    dynamics: tuple[float, float]


SETTINGS: Mapping[str, Setting] = {
    **{
        name: Setting(1.0, (0.1, 0.05), (observed, observed), (0.1, 0.05))
        for name, observed in (("A", 0.1), ("B", 0.3), ("C", 0.5))
    },
    "G": Setting(0.2, (0.05, 0.05), (0.2, 0.2), (0.05, 0.05)),
}
"""Sets by name: the printed weights with accurate, middling and poor observations; a tuned one."""


class Course(NamedTuple):
    """What happens to the point: positions and colours.

    Attributes
    ----------
    start : ndarray of float64, shape (2,)
        Before the first frame.
    truth, observed : ndarray of float64, shape (frames, 2)
    """

    start: Array
    truth: Array
    observed: Array


def course(setting: Setting, frames: int, generator: np.random.Generator) -> Course:
    """Draw a course: both features go back to the middle and are thrown out again, in bounds."""
    start = generator.uniform(*_STARTS)
    truth = np.empty((frames, 2))
    state = start
    for frame, steps in enumerate(generator.normal(0.0, setting.noise, (frames, 2))):
        # (x - μ) σ + N(μ_noise, σ_noise) with μ_noise = μ
        state = (state - _MIDDLES) * DECAY + _MIDDLES + steps
        state = np.clip(state, *np.transpose([POSITIONS, COLOURS]))
        truth[frame] = state
    return Course(start, truth, truth + generator.normal(0.0, setting.observed, (frames, 2)))


class Feature(ParticleCue):
    """A random walk of position or colour, weighed by exp(-d / λ).

    d is the distance to what is observed of it (PF1), and of what has a colour attached, that of
    this colour besides (PF2). An observation is a pair of position and colour.
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
    """No knowledge of the colour: all are equally likely, before the frame and after it."""

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
        """See `Cue.receive`: nothing is learnt."""


def chain(kind: Filter, setting: Setting, samples: int, start: Array) -> Chain[Array]:
    """Cues at the beginning of a course, which is known.

    The colour filter is the first and position the last. Between them, where they are independent,
    stands what gives positions any colour.
    """
    colour, position = (Feature(one, start, samples, setting) for one in (COLOUR, POSITION))
    if kind == "independent":
        return Chain([colour, AnyColour(samples), position])
    return Chain([colour, position], "by-weight" if kind == "dependent" else "uniform")


def estimates(
    kind: Filter, setting: Setting, samples: int, seen: Course, generator: np.random.Generator
) -> Array:
    """Follow a course.

    Returns
    -------
    ndarray of float64, shape (frames, 4)
        Σ π₂ s₂, Σ π₂ s₁ of the colours attached, Σ π₁ s₁ of the colour filter, and the effective
        sample size of the positions as a share of their number.
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
