"""Time to failure: how long trackers keep a target.

A run that was never lost is *censored* at its end: it would have gone on for at least as long.
"""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Survival(NamedTuple):
    """A step function: from each of k times on, the share that is not lost, with its band.

    All have the shape (k,); shares are in [0, 1], `low` and `high` NaN where nobody was lost yet.
    """

    times: NDArray[np.float64]
    shares: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def kaplan_meier(times: ArrayLike, lost: ArrayLike) -> Survival:
    """Return Kaplan and Meier's estimate of the share that survives, with a 95 % band (log-log).

    `times`: when each run was lost, or ended, in any unit of time. `lost`: whether it was lost.
    """
    from scipy.stats import CensoredData, ecdf  # half a second, for a figure alone

    ends, failed = np.asarray(times, np.float64), np.asarray(lost, bool)
    estimate = ecdf(CensoredData.right_censored(ends, ~failed)).sf
    with warnings.catch_warnings():
        # Where nobody or everybody is lost the formula has no band, and says so: NaN is the answer.
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        band = estimate.confidence_interval(method="log-log")
    return Survival(
        estimate.quantiles, estimate.probabilities, band.low.probabilities, band.high.probabilities
    )
