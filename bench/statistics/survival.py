"""Time to failure: how long trackers keep a target.

A run without failure is *censored* at its end: the target was kept for at least as long.
"""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Survival(NamedTuple):
    """Step function: from each time on, the share of runs without failure, with its band.

    Every field has shape (k,). `low` and `high` are NaN before the first failure.
    """

    times: NDArray[np.float64]
    shares: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def kaplan_meier(times: ArrayLike, lost: ArrayLike) -> Survival:
    """Return Kaplan and Meier's estimate of the share that survives, with a 95 % band (log-log).

    `times`: time of failure or end of each run, in any unit. `lost`: whether the run failed.
    """
    from scipy.stats import CensoredData, ecdf  # takes half a second, only for a figure

    ends, failed = np.asarray(times, np.float64), np.asarray(lost, bool)
    estimate = ecdf(CensoredData.right_censored(ends, ~failed)).sf
    with warnings.catch_warnings():
        # If no run or every run fails, the formula has no band: NaN is the result.
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        band = estimate.confidence_interval(method="log-log")
    return Survival(
        estimate.quantiles, estimate.probabilities, band.low.probabilities, band.high.probabilities
    )
