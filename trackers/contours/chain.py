"""Chain of conditionally dependent cues (Moreno-Noguer, Sanfeliu & Samaras 2005).

The joint density of all states is the product of each cue's density given the previous cues
(equation 2), computed in their order. Any object that implements `Cue` can be part of a chain.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Indices
from trackmark.trackers.base.particles import multinomial, systematic

Attached: TypeAlias = Indices | None
Association: TypeAlias = Literal["by-weight", "uniform"]
Feedback: TypeAlias = Literal["marginal", "joint"]

_NEVER_QUITE_ZERO = 1e-12  # relative weight of a hypothesis that is not attached to any other


class Weighed(NamedTuple):
    """Weights of a cue's hypotheses in a frame."""

    weights: Array  # (n,): ≥ 0, up to a common factor
    evidence: Any = None  # data on each hypothesis, for later cues


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """Weighted hypotheses of a cue in a frame."""

    states: NDArray[Any]  # (n, ...): one hypothesis per row
    weights: Array  # (n,), of sum 1
    attached: Attached = None  # (n,): attached hypotheses of the previous cue
    evidence: Any = None  # see `Weighed`


Earlier: TypeAlias = Sequence[Hypotheses]


class Cue(Protocol):
    """Feature of the target: state density, dynamic model and observation model."""

    def sample(self, generator: np.random.Generator) -> NDArray[Any]:
        """Draw hypotheses (n, ...) from the predicted density of the state.

        A particle filter resamples and propagates; a Kalman filter samples its prediction.
        """
        ...

    def weigh(
        self, observation: Any, states: NDArray[Any], attached: Attached, earlier: Earlier
    ) -> Weighed:
        """Weigh hypotheses by the frame and by attached hypotheses of earlier cues.

        All cues get the same `observation`. `attached` (n,) is the row in `earlier[-1]` of the
        hypothesis that is attached to each state; it is None for the first cue.
        """
        ...

    def receive(self, states: NDArray[Any], weights: Array) -> None:
        """Set the state's density in this frame to the weighted hypotheses."""
        ...


class Chain:
    """Cues in the order of their dependence: each may depend on all previous ones.

    `cues` sequence of Cue: the cues, in order.
    `association` {"by-weight", "uniform"}: how hypotheses of the previous cue are attached to those
      of a cue: drawn by their weights in this frame (section 5.3), or uniformly.
    `feedback` {"marginal", "joint"}: weights with which a cue enters the next frame. `marginal`:
      the cue's own weights (equation 4). `joint`: its weights in the complete density (equation 7),
      which later cues also affect. `joint` corrects the paper: if z₂ depends on x₁, p(x₁ | z₁, z₂)
      differs from p(x₁ | z₁).
    """

    def __init__(
        self,
        cues: Sequence[Cue],
        association: Association = "by-weight",
        feedback: Feedback = "marginal",
    ) -> None:
        self.cues = tuple(cues)
        self.association = association
        self.feedback = feedback

    def step(self, observation: Any, generator: np.random.Generator) -> tuple[Hypotheses, ...]:
        """Process a frame; return the weighted hypotheses of each cue, in order."""
        all_hypotheses: list[Hypotheses] = []
        for cue in self.cues:
            states = cue.sample(generator)
            attached = (
                self._attached(all_hypotheses[-1].weights, len(states), generator)
                if all_hypotheses
                else None
            )
            weighed = cue.weigh(observation, states, attached, all_hypotheses)
            weights = normalise_weights(weighed.weights)
            all_hypotheses.append(Hypotheses(states, weights, attached, weighed.evidence))
        carried = (
            _joint_weights(all_hypotheses)
            if self.feedback == "joint"
            else [h.weights for h in all_hypotheses]
        )
        for cue, hypotheses, weights in zip(self.cues, all_hypotheses, carried, strict=True):
            cue.receive(hypotheses.states, weights)
        return tuple(all_hypotheses)

    def _attached(self, weights: Array, count: int, generator: np.random.Generator) -> Indices:
        uniforms = generator.random(count)
        if self.association == "uniform":
            weights = np.full(len(weights), 1 / len(weights))
        return multinomial(weights, uniforms)


def complete_combinations(hypotheses: Sequence[Hypotheses]) -> tuple[Indices, ...]:
    """Return the combinations of hypotheses in the complete density of equation 7.

    The result has one array (n,) per cue: the index of its hypothesis in each of n combinations.
    Combination i contains hypothesis i of the last cue and has its weight.
    """
    last = hypotheses[-1]
    combinations = [np.arange(len(last.weights), dtype=np.intp)]
    for later in reversed(hypotheses[1:]):
        assert later.attached is not None
        combinations.append(later.attached[combinations[-1]])
    return tuple(reversed(combinations))


def normalise_weights(weights: Array) -> Array:
    """Return weights scaled to sum 1; equal weights if the sum is not positive and finite.

    Examples
    --------
    >>> normalise_weights(np.array([1.0, 3.0])).tolist()
    [0.25, 0.75]
    >>> normalise_weights(np.zeros(2)).tolist()
    [0.5, 0.5]
    """
    total = float(weights.sum())
    if not np.isfinite(total) or total <= 0:
        return np.full(len(weights), 1 / len(weights))
    return weights / total


def _joint_weights(all_hypotheses: Sequence[Hypotheses]) -> list[Array]:
    """Return the weights of each cue's hypotheses in the complete density (its marginals)."""
    last = all_hypotheses[-1].weights
    carried = [last]
    indices = complete_combinations(all_hypotheses)
    for cue in reversed(range(len(all_hypotheses) - 1)):
        shares = np.zeros(len(all_hypotheses[cue].weights))
        np.add.at(shares, indices[cue], last)
        carried.append(normalise_weights(shares + _NEVER_QUITE_ZERO))
    return carried[::-1]


class ParticleCue(ABC):
    """Base class of particle filter cues (Moreno-Noguer et al. 2005, section 2).

    All `count` particles have the initial state `start`. The attributes are `states` (count, ...)
    and their `weights` (count,) of sum 1. A subclass adds `Cue.weigh`.
    """

    def __init__(self, start: NDArray[Any], count: int) -> None:
        self.states = np.repeat(start[np.newaxis], count, axis=0)
        self.weights = np.full(count, 1 / count)

    @abstractmethod
    def propagated(self, states: NDArray[Any], generator: np.random.Generator) -> NDArray[Any]:
        """Return the states after the dynamic model, a new array of the same shape."""

    def sample(self, generator: np.random.Generator) -> NDArray[Any]:
        """Resample systematically and apply the dynamic model; see `Cue.sample`."""
        chosen = systematic(self.weights, generator.random(len(self.weights)))
        return self.propagated(self.states[chosen], generator)

    def receive(self, states: NDArray[Any], weights: Array) -> None:
        """See `Cue.receive`."""
        self.states = states
        self.weights = weights
