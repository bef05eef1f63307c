"""Weighted samples of a cue, {s, π}: how they are drawn and weighed (section 2)."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["Samples", "drawn", "normalised", "shares", "weights_of"]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Samples:
    """Samples of one cue.

    Parameters
    ----------
    start : ndarray
        State in the first frame, which all of them have there.
    count : int
        N.

    Attributes
    ----------
    states : ndarray of float64, shape (N, ...)
        s in the last frame.
    weights : ndarray of float64, shape (N,)
        π that the last frame gave.
    carried : ndarray of float64, shape (N,)
        π with which they go on.
    attached : ndarray of intp, shape (N,)
        Sample of the cue before with which each was weighed; none for the first cue.
    """

    def __init__(self, start: Array, count: int) -> None:
        self.states = np.stack([start] * count)
        self.weights = self.carried = np.full(count, 1 / count)
        self.attached: Indices = np.zeros(0, np.intp)

    def resampled(self, random: np.random.Generator) -> Array:
        """States drawn by weight, in equal steps from one random number."""
        n = len(self.states)
        positions = (np.arange(n) + random.random(n)[0]) / n
        return self.states[drawn(self.carried, positions)]


def drawn(weights: Array, positions: Array) -> Indices:
    """Sample at each position, in [0, 1), of the summed weights."""
    cumulative = np.cumsum(weights)
    found = np.searchsorted(cumulative, positions * cumulative[-1], side="right")
    return np.asarray(np.minimum(found, len(weights) - 1))


def weights_of(differences: Array, kind: str, temperature: float) -> Array:
    """π of differences d of mean posteriors (sections 5.2 to 5.4)."""
    if kind == "literal":
        return normalised(np.maximum(differences, 0))
    return normalised(np.exp((differences - differences.max()) / temperature))


def normalised(weights: Array) -> Array:
    """Of sum one; all equal where none is above 0."""
    total = weights.sum()
    return weights / total if total > 0 else np.full(len(weights), 1 / len(weights))


def shares(attached: Indices, weights: Array, count: int) -> Array:
    """What weights sum to over those that each of so many samples is attached to."""
    return np.array([weights[attached == sample].sum() for sample in range(count)])
