"""Weights of particles and what they say of the state.

Weights come as logarithms: a likelihood that underflows would leave no particle standing.
"""

from math import inf

import numpy as np
from numpy.typing import NDArray

__all__ = ["effective_number", "mean_state", "normalised"]


def normalised(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights that sum to one.

    Parameters
    ----------
    log_weights : ndarray of float64, shape (n,)
        Logarithms of weights up to a common factor; -inf is a weight of zero.

    Returns
    -------
    ndarray of float64, shape (n,)
        In proportion to the exponentials; all equal where every weight is zero.

    Examples
    --------
    >>> normalised(np.array([-5000.0, -5000.0, -np.inf])).tolist()
    [0.5, 0.5, 0.0]
    """
    largest = log_weights.max()
    if largest == -inf:
        return np.full(len(log_weights), 1 / len(log_weights))
    weights: NDArray[np.float64] = np.exp(log_weights - largest)
    weights /= weights.sum()
    return weights


def mean_state(weights: NDArray[np.float64], states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted mean of the particles' states, E[s] = Σ πᵢ sᵢ (Isard & Blake 1998).

    Parameters
    ----------
    weights : ndarray of float64, shape (n,)
        Normalised.
    states : ndarray of float64, shape (n, dimensions)
        One row a particle.
    """
    return weights @ states


def effective_number(weights: NDArray[np.float64]) -> float:
    """Effective number of particles, 1 / Σ πᵢ² (Kong, Liu & Wong 1994), in [1, n].

    Examples
    --------
    >>> effective_number(np.array([0.25, 0.25, 0.25, 0.25]))
    4.0
    """
    return 1.0 / float(weights @ weights)
