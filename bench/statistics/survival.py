"""Survival analysis of the time to failure.

A run without failure is *censored* at its end: the time to failure is at least its length.
"""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Survival(NamedTuple):
    """Survival curve with its band: share of runs without failure, constant from each time on.

    Every field has shape (k,). `low` and `high` are NaN before the first failure.
    """

    times: NDArray[np.float64]
    shares: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def kaplan_meier(times: ArrayLike, lost: ArrayLike) -> Survival:
    """Return the Kaplan-Meier estimate of survival with a 95 % band (log-log).

    Each run has the time of its loss or of its end, in any unit, and `lost` is True if it lost the
    target. The other runs are censored: they could have lost it later.
    """
    # Imported here: it takes 0.5 s, and only figures need it.
    from scipy.stats import CensoredData, ecdf

    ends, failed = np.asarray(times, np.float64), np.asarray(lost, bool)
    estimate = ecdf(CensoredData.right_censored(ends, ~failed)).sf
    with warnings.catch_warnings():
        # The band is undefined (NaN) if no run or every run fails.
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        band = estimate.confidence_interval(method="log-log")
    return Survival(
        estimate.quantiles, estimate.probabilities, band.low.probabilities, band.high.probabilities
    )
