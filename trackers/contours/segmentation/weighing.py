"""From what a region's posterior says to the weights of hypotheses."""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Weights", "graded"]

Array: TypeAlias = NDArray[np.float64]
Weights: TypeAlias = Literal["literal", "exponential"]

NOISE = 1e-6  # of differences of posteriors in single precision


def graded(scores: Array, weights: Weights, temperature: float) -> Array:
    """Weights of hypotheses, up to a common factor.

    Parameters
    ----------
    scores : ndarray of float64, shape (n,)
        Mean posterior in a region minus the mean outside, in [-1, 1].
    weights : {'literal', 'exponential'}
        The difference itself, not below 0 (Moreno-Noguer et al. 2005, section 5), nor what
        rounding makes of 0, or
        exp(difference / temperature). Good and mediocre hypotheses differ by some hundredths, so
        that the former hardly tells them apart.
    temperature : float
        Above 0, in units of the difference.

    Examples
    --------
    >>> graded(np.array([-0.5, 0.2]), "literal", 1.0).tolist()
    [0.0, 0.2]
    >>> graded(np.array([0.0, 0.1]), "exponential", 0.1).round(3).tolist()
    [0.368, 1.0]
    """
    if weights == "literal":
        return np.where(scores > NOISE, scores, 0.0)
    exponentials: Array = np.exp((scores - scores.max()) / temperature)
    return exponentials
