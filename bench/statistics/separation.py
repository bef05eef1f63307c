"""How well a number tells two classes apart."""

import numpy as np
from numpy.typing import ArrayLike


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
