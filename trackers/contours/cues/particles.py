"""A cue whose density is a set of particles."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackers.particles.resampling import systematic

__all__ = ["ParticleCue"]


class ParticleCue(ABC):
    """Particles that are resampled and propagated (Moreno-Noguer et al. 2005, section 2).

    To be a `Cue` it lacks how it weighs its particles.

    Parameters
    ----------
    start : ndarray, shape (...)
        The state in the first frame: all particles begin there.
    count : int
        How many there are.

    Attributes
    ----------
    states : ndarray, shape (count, ...)
        The particles after the last frame.
    weights : ndarray of float64, shape (count,)
        Theirs; they sum to 1.
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

    def receive(self, states: NDArray[Any], weights: NDArray[np.float64]) -> None:
        """See `Cue.receive`."""
        self.states = states
        self.weights = weights
