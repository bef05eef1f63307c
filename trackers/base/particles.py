"""Particle filtering: weights of samples of a state, their mean, and which of them go on.

Weights come as logarithms: a likelihood that underflows would leave no particle standing. A scheme
of resampling takes normalised weights, shape (n,), and as many numbers uniform on [0, 1), of which
it uses what it needs, and gives the indices of the particles that go on. A particle of weight π is
expected to go on in n π copies under every scheme; they differ in how far from that they stray.
"""

from collections.abc import Callable, Mapping
from math import inf

import numpy as np

from trackmark.trackers.base.arrays import Array, Indices

_BELOW_ONE = float(np.nextafter(1.0, 0.0))


def normalised(log_weights: Array) -> Array:
    """Weights (n,) of sum one from their logarithms up to a common factor; -inf is a weight of 0.

    All are equal where every weight is zero.

    Examples
    --------
    >>> normalised(np.array([-5000.0, -5000.0, -np.inf])).tolist()
    [0.5, 0.5, 0.0]
    """
    largest = log_weights.max()
    if largest == -inf:
        return np.full(len(log_weights), 1 / len(log_weights))
    weights: Array = np.exp(log_weights - largest)
    weights /= weights.sum()
    return weights


def mean_state(weights: Array, states: Array) -> Array:
    """Weighted mean of states, one a row, E[s] = Σ πᵢ sᵢ (Isard & Blake 1998)."""
    return weights @ states


def effective_number(weights: Array) -> float:
    """Effective number of particles, 1 / Σ πᵢ² (Kong, Liu & Wong 1994), in [1, n].

    Examples
    --------
    >>> effective_number(np.array([0.25, 0.25, 0.25, 0.25]))
    4.0
    """
    return 1.0 / float(weights @ weights)


def multinomial(weights: Array, uniforms: Array) -> Indices:
    """Independent draws with replacement, the scheme of Condensation (Isard & Blake 1998)."""
    return _found(weights, uniforms)


def stratified(weights: Array, uniforms: Array) -> Indices:
    """One draw from each of n equal strata of the cumulative weights (Kitagawa 1996)."""
    return _found(weights, (np.arange(len(uniforms)) + uniforms) / len(uniforms))


def systematic(weights: Array, uniforms: Array) -> Indices:
    """Equally spaced draws, all shifted by the one first number (Kitagawa 1996)."""
    return _found(weights, (np.arange(len(uniforms)) + uniforms[0]) / len(uniforms))


def residual(weights: Array, uniforms: Array) -> Indices:
    """⌊n π⌋ copies of each, the rest drawn from what is left over (Liu & Chen 1998)."""
    expected = len(weights) * weights
    copies = np.floor(expected + 1e-9).astype(np.intp)  # 49 · (1/49) is less than 1
    sure = np.repeat(np.arange(len(weights)), copies)
    left = np.maximum(expected - copies, 0.0)
    return np.concatenate([sure, _found(left, uniforms[len(sure) :])])


SCHEMES: Mapping[str, Callable[[Array, Array], Indices]] = {
    "multinomial": multinomial,
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
}
"""The schemes by name."""


def _found(weights: Array, positions: Array) -> Indices:
    """Particle at each position in [0, 1] of the cumulative weights, never one of weight 0."""
    cumulative = weights.cumsum()
    sought = np.minimum(positions, _BELOW_ONE) * cumulative[-1]
    found: Indices = cumulative.searchsorted(sought, side="right")
    return found
