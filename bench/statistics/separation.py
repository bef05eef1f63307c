"""How well a number tells two classes apart."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ndtri

from bench.statistics.intervals import Interval

__all__ = ["auc", "auc_interval", "error_share", "zero_error_thresholds"]


def auc(positive: ArrayLike, negative: ArrayLike) -> float:
    """Area under the receiver's operating curve: P(positive > negative), ties count half.

    Parameters
    ----------
    positive, negative : array of float, shapes (m,) and (n,)
        The number in members of either class, one or more.

    Examples
    --------
    >>> auc([0.5, 0.6], [0.1, 0.5])
    0.875
    """
    difference = np.subtract.outer(np.asarray(positive, float), np.asarray(negative, float))
    return float((np.sign(difference).mean() + 1) / 2)


def auc_interval(area: float, positives: int, negatives: int) -> Interval:
    """95 % interval of an area under the curve: the areas that it does not lie too far from.

    The variance is Hanley and McNeil's (1982), at the area that is asked about, as in the fifth
    method of Newcombe (2006). So it is of some width also where nothing is told wrongly.

    Parameters
    ----------
    area : float
        As `auc` gives it.
    positives, negatives : int
        Members of the classes, one or more.

    Examples
    --------
    >>> print("{:.3f} {:.3f}".format(*auc_interval(1.0, 40, 40)))
    0.950 1.000
    """
    half, pairs = (positives + negatives) / 2 - 1, positives * negatives
    quantile = float(ndtri(0.975))

    def beyond(true: float) -> float:
        spread = 1 + half * ((1 - true) / (2 - true) + true / (1 + true))
        return (area - true) ** 2 - quantile**2 * true * (1 - true) * spread / pairs

    low = brentq(beyond, 0.0, min(area, 1 - 1e-9)) if area > 0 else 0.0
    high = brentq(beyond, max(area, 1e-9), 1.0) if area < 1 else 1.0
    return Interval(float(low), float(high))


def error_share(positive: ArrayLike, negative: ArrayLike, threshold: float) -> float:
    """Share of wrong answers of "above the threshold is positive".

    Examples
    --------
    >>> error_share([0.5, 0.3], [0.1, 0.2], 0.4)
    0.25
    """
    missed = np.asarray(positive, float) <= threshold
    false = np.asarray(negative, float) > threshold
    return float(np.concatenate([missed, false]).mean())


def zero_error_thresholds(positive: ArrayLike, negative: ArrayLike) -> tuple[float, float] | None:
    """From (included) and up to (excluded) which thresholds make no error; None where all do.

    Examples
    --------
    >>> zero_error_thresholds([0.5, 0.3], [0.1, 0.2])
    (0.2, 0.3)
    """
    lowest, highest = float(np.max(np.asarray(negative))), float(np.min(np.asarray(positive)))
    return (lowest, highest) if lowest < highest else None
