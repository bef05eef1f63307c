"""Holm's correction, until `regression` has the shared rules."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["holm"]


def holm(values: ArrayLike) -> NDArray[np.float64]:
    """Holm's adjusted p of m tests, (m,): below α, they are wrong together in at most α of cases.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    given = np.asarray(values, np.float64)
    order = np.argsort(given, kind="stable")
    steps = given[order] * (len(given) - np.arange(len(given)))
    adjusted = np.empty(len(given))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return adjusted
