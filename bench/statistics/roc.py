"""How well a number tells two classes apart."""

import numpy as np
from numpy.typing import ArrayLike


def auc(positive: ArrayLike, negative: ArrayLike) -> float:
    """Return the area under the ROC curve: P(positive > negative), ties count half.

    `positive`, `negative`: the number in the members of either class, one or more.

    >>> auc([0.5, 0.6], [0.1, 0.5])
    0.875
    """
    difference = np.subtract.outer(np.asarray(positive, float), np.asarray(negative, float))
    return float((np.sign(difference).mean() + 1) / 2)


def error_share(positive: ArrayLike, negative: ArrayLike, threshold: float) -> float:
    """Return the share of wrong answers of "above the threshold is positive".

    >>> error_share([0.5, 0.3], [0.1, 0.2], 0.4)
    0.25
    """
    missed = np.asarray(positive, float) <= threshold
    false = np.asarray(negative, float) > threshold
    return float(np.concatenate([missed, false]).mean())


def zero_error_thresholds(positive: ArrayLike, negative: ArrayLike) -> tuple[float, float] | None:
    """Return from (included) and up to (excluded) which thresholds make no error, or None.

    >>> zero_error_thresholds([0.5, 0.3], [0.1, 0.2])
    (0.2, 0.3)
    """
    lowest, highest = float(np.max(np.asarray(negative))), float(np.min(np.asarray(positive)))
    return (lowest, highest) if lowest < highest else None
