"""Particle filter functions: normalised weights, mean state, effective sample size, resampling.

Likelihoods are passed as logarithms, because a likelihood of every particle could underflow to 0. A
resampling scheme takes normalised weights (n,) and n uniform random numbers in [0, 1), and returns
the indices (n,) of the selected particles. In every scheme, the expected number of copies of a
particle of weight π is n π. The schemes differ in the variance of that number.
"""

from collections.abc import Callable, Mapping
from math import inf

import numpy as np

from trackmark.trackers.base.arrays import Array, Indices

_BELOW_ONE = float(np.nextafter(1.0, 0.0))


def normalise_log_weights(log_weights: Array) -> Array:
    """Return weights (n,) that sum to 1, from logarithms (n,) of unnormalised weights.

    -inf stands for a weight of 0. If all weights are 0, the result is uniform.

    Examples
    --------
    >>> normalise_log_weights(np.array([-5000.0, -5000.0, -np.inf])).tolist()
    [0.5, 0.5, 0.0]
    """
    largest = log_weights.max()
    if largest == -inf:
        return np.full(len(log_weights), 1 / len(log_weights))
    weights: Array = np.exp(log_weights - largest)
    weights /= weights.sum()
    return weights


def mean_state(weights: Array, states: Array) -> Array:
    """Return the weighted mean of states, one per row: E[s] = Σ πᵢ sᵢ (Isard & Blake 1998)."""
    return weights @ states


def effective_sample_size(weights: Array) -> float:
    """Return the effective sample size, 1 / Σ πᵢ² (Kong, Liu & Wong 1994), in [1, n].

    Examples
    --------
    >>> effective_sample_size(np.array([0.25, 0.25, 0.25, 0.25]))
    4.0
    """
    return 1.0 / float(weights @ weights)


def multinomial(weights: Array, uniforms: Array) -> Indices:
    """Select particles by independent draws, as in Condensation (Isard & Blake 1998)."""
    return _select_particles(weights, uniforms)


def stratified(weights: Array, uniforms: Array) -> Indices:
    """Select a particle from each of n equal strata of the cumulative weights (Kitagawa 1996)."""
    return _select_particles(weights, (np.arange(len(uniforms)) + uniforms) / len(uniforms))


def systematic(weights: Array, uniforms: Array) -> Indices:
    """Select at equally spaced cumulative weights, shifted by one number (Kitagawa 1996)."""
    return _select_particles(weights, (np.arange(len(uniforms)) + uniforms[0]) / len(uniforms))


def residual(weights: Array, uniforms: Array) -> Indices:
    """Copy each particle ⌊n π⌋ times, then select by residual weights (Liu & Chen 1998)."""
    expected = len(weights) * weights
    copies = np.floor(expected + 1e-9).astype(np.intp)  # in floating point, 49 · (1/49) < 1
    sure = np.repeat(np.arange(len(weights)), copies)
    left = np.maximum(expected - copies, 0.0)
    return np.concatenate([sure, _select_particles(left, uniforms[len(sure) :])])


SCHEMES: Mapping[str, Callable[[Array, Array], Indices]] = {
    "multinomial": multinomial,
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
}
"""Resampling schemes by name."""


def _select_particles(weights: Array, positions: Array) -> Indices:
    """Return the particle (of weight > 0) at each position in [0, 1] of the cumulative weights."""
    cumulative = weights.cumsum()
    sought = np.minimum(positions, _BELOW_ONE) * cumulative[-1]
    selected: Indices = cumulative.searchsorted(sought, side="right")
    return selected
