"""Conditionally dependent cues in a chain (Moreno-Noguer, Sanfeliu & Samaras 2005).

The density of all cues' states is the product of each cue's, given those before it (equation 2),
and is computed in their order. The chain knows nothing of what the cues are: whatever yields
hypotheses and weighs them can take a place in it.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, NamedTuple, Protocol, TypeAlias, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Indices
from trackmark.trackers.base.particles import multinomial, systematic

Attached: TypeAlias = Indices | None
Association: TypeAlias = Literal["by-weight", "uniform"]
Feedback: TypeAlias = Literal["marginal", "joint"]

_NEVER_QUITE_ZERO = 1e-12  # what an unattached hypothesis keeps, as a share of all

Observation = TypeVar("Observation", contravariant=True)
Seen = TypeVar("Seen")


class Weighed(NamedTuple):
    """What a cue says of its hypotheses in a frame."""

    weights: Array  # (n,): not negative, up to a common factor
    evidence: Any = None  # what it found out about each of them, for the cues that depend on it


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """Weighted hypotheses of a cue in a frame."""

    states: NDArray[Any]  # (n, ...): one hypothesis a row
    weights: Array  # (n,), of sum 1
    attached: Attached = None  # (n,): hypotheses of the cue before that they went with
    evidence: Any = None  # see `Weighed`


Earlier: TypeAlias = Sequence[Hypotheses]


class Cue(Protocol[Observation]):
    """One feature of the target: its state, how this goes on, and how a frame judges it."""

    def sample(self, generator: np.random.Generator) -> NDArray[Any]:
        """Draw hypotheses, shape (n, ...), from the state's density before the frame is seen.

        A particle filter resamples and propagates; a Kalman filter draws from its prediction.
        """
        ...

    def weigh(
        self, observation: Observation, states: NDArray[Any], attached: Attached, earlier: Earlier
    ) -> Weighed:
        """Judge them by the frame, and by those of the earlier cues, which stand in order.

        `observation` is the same for all cues. `attached` (n,) says for each of the `states` which
        hypothesis of the cue before it goes with, a row of `earlier[-1]`; None for the first cue.
        """
        ...

    def receive(self, states: NDArray[Any], weights: Array) -> None:
        """Take the weighted hypotheses as the state's density of this frame."""
        ...


class Chain(Generic[Seen]):
    """Cues in the order of their dependence: each may depend on all before it.

    `association` says which hypotheses of the cue before are attached to a cue's: drawn by the
    weights that the frame has just given them (section 5.3), or evenly, as if nothing were known of
    them. `feedback` says with which weights a cue goes on to the next frame: those that it gave
    itself (equation 4), or those that its hypotheses have in the complete density of equation 7, so
    that what the later cues saw comes back. The latter is a correction of the paper: the density of
    x₁ given all measurements is not that given z₁ alone where z₂ depends on x₁.

    Raises ValueError for another association or feedback; in a step, for weights below 0 or of
    another number than the hypotheses.
    """

    def __init__(
        self,
        cues: Sequence[Cue[Seen]],
        association: Association = "by-weight",
        feedback: Feedback = "marginal",
    ) -> None:
        for value, known in ((association, Association), (feedback, Feedback)):
            if value not in get_args(known):
                raise ValueError(f"{value!r} is none of {', '.join(get_args(known))}.")
        self.cues = tuple(cues)
        self.association = association
        self.feedback = feedback

    def step(self, observation: Seen, generator: np.random.Generator) -> tuple[Hypotheses, ...]:
        """Go through one frame: what each cue holds for possible then, in their order."""
        found: list[Hypotheses] = []
        for cue in self.cues:
            states = cue.sample(generator)
            attached = self._attached(found[-1].weights, len(states), generator) if found else None
            weighed = cue.weigh(observation, states, attached, found)
            if weighed.weights.shape != (len(states),) or (weighed.weights < 0).any():
                raise ValueError(
                    f"{type(cue).__name__} gives weights of shape {weighed.weights.shape} to "
                    f"{len(states)} hypotheses: each has one, not below 0."
                )
            weights = normalise_weights(weighed.weights)
            found.append(Hypotheses(states, weights, attached, weighed.evidence))
        carried = _joint_weights(found) if self.feedback == "joint" else [h.weights for h in found]
        for cue, hypotheses, weights in zip(self.cues, found, carried, strict=True):
            cue.receive(hypotheses.states, weights)
        return tuple(found)

    def _attached(self, weights: Array, count: int, generator: np.random.Generator) -> Indices:
        uniforms = generator.random(count)
        if self.association == "uniform":
            weights = np.full(len(weights), 1 / len(weights))
        return multinomial(weights, uniforms)


def complete_combinations(hypotheses: Sequence[Hypotheses]) -> tuple[Indices, ...]:
    """Which hypotheses of each cue make up the complete density of equation 7.

    One array (n,) a cue: its hypothesis for each of the n of the last cue, whose weights are those
    of the combinations.
    """
    last = hypotheses[-1]
    chosen = [np.arange(len(last.weights), dtype=np.intp)]
    for later in reversed(hypotheses[1:]):
        if later.attached is None:
            raise ValueError("a cue's hypotheses are attached to none of the cue before.")
        chosen.append(later.attached[chosen[-1]])
    return tuple(reversed(chosen))


def normalise_weights(weights: Array) -> Array:
    """Weights that sum to 1; all equal where none is above 0, or not all are finite.

    Examples
    --------
    >>> proportional(np.array([1.0, 3.0])).tolist()
    [0.25, 0.75]
    >>> proportional(np.zeros(2)).tolist()
    [0.5, 0.5]
    """
    total = float(weights.sum())
    if not np.isfinite(total) or total <= 0:
        return np.full(len(weights), 1 / len(weights))
    return weights / total


def _joint_weights(found: Sequence[Hypotheses]) -> list[Array]:
    """Weights of each cue's hypotheses in the complete density (its marginals)."""
    last = found[-1].weights
    carried = [last]
    for hypotheses, indices in zip(
        reversed(found[:-1]), reversed(complete_combinations(found)[:-1]), strict=True
    ):
        shares = np.zeros(len(hypotheses.weights))
        np.add.at(shares, indices, last)
        carried.append(normalise_weights(shares + _NEVER_QUITE_ZERO))
    return carried[::-1]


class ParticleCue(ABC):
    """Particles that are resampled and propagated (Moreno-Noguer et al. 2005, section 2).

    `count` of them begin in the state `start`. To be a `Cue` it lacks how it weighs its particles:
    `states` (count, ...), whose `weights` (count,) sum to 1.
    """

    def __init__(self, start: NDArray[Any], count: int) -> None:
        self.states = np.repeat(start[np.newaxis], count, axis=0)
        self.weights = np.full(count, 1 / count)

    @abstractmethod
    def propagated(self, states: NDArray[Any], generator: np.random.Generator) -> NDArray[Any]:
        """Where the dynamic model takes them, a fresh array of the same shape."""

    def sample(self, generator: np.random.Generator) -> NDArray[Any]:
        """See `Cue.sample`: systematic resampling, then the dynamic model."""
        chosen = systematic(self.weights, generator.random(len(self.weights)))
        return self.propagated(self.states[chosen], generator)

    def receive(self, states: NDArray[Any], weights: Array) -> None:
        """See `Cue.receive`."""
        self.states = states
        self.weights = weights
