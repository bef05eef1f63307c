"""Time to failure: how long trackers keep a target, and whether two differ in that.

A run that was never lost is *censored* at its end: it would have gone on for at least as long.
"""

import warnings
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

__all__ = ["Survival", "kaplan_meier", "log_rank"]


class Survival(NamedTuple):
    """A step function: from each of k times on, the share that is not lost, with its band.

    All have the shape (k,); shares are in [0, 1], `low` and `high` NaN where nobody was lost yet.
    """

    times: NDArray[np.float64]
    shares: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def kaplan_meier(times: ArrayLike, lost: ArrayLike) -> Survival:
    """Kaplan and Meier's estimate of the share that survives, with a 95 % band (log-log).

    Parameters
    ----------
    times : array of float, shape (n,)
        When each run was lost, or ended; in any unit of time.
    lost : array of bool, shape (n,)
        Whether it was lost then.
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


def log_rank(
    strata: Iterable[tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]],
) -> tuple[float, float]:
    """Log-rank test of two trackers' times to failure, stratified by sequence.

    Within each sequence the losses of the first tracker are set against how many it would have
    if both were lost alike; these differences add up over the sequences (Mantel and Haenszel).

    Parameters
    ----------
    strata : iterable of (times, lost, times, lost)
        Of the first and the second tracker's runs on a sequence; see `kaplan_meier`.

    Returns
    -------
    excess : float
        Losses of the first tracker beyond the expected ones, over all sequences.
    p : float
        Of a chi-square with one degree of freedom; 1 where nothing was lost.
    """
    excess = variance = 0.0
    for first, first_lost, second, second_lost in strata:
        ends, failed = np.concatenate([first, second]), np.concatenate([first_lost, second_lost])
        moments = np.unique(ends[failed.astype(bool)])
        ours = _counts(first, first_lost, moments)
        everybody = ours + _counts(second, second_lost, moments)
        at_risk, losses = everybody
        share = ours[0] / at_risk
        excess += float((ours[1] - losses * share).sum())
        spread = losses * share * (1 - share) * (at_risk - losses)
        variance += float((spread / np.maximum(at_risk - 1, 1)).sum())
    if variance <= 0:
        return excess, 1.0
    return excess, float(chdtrc(1, excess**2 / variance))


def _counts(times: ArrayLike, lost: ArrayLike, moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """How many are at risk, and how many are lost, at each of k moments: (2, k)."""
    ends, failed = np.sort(np.asarray(times, np.float64)), np.asarray(lost, bool)
    gone = np.sort(np.asarray(times, np.float64)[failed])
    at_risk = len(ends) - np.searchsorted(ends, moments, "left")
    losses = np.searchsorted(gone, moments, "right") - np.searchsorted(gone, moments, "left")
    return np.array([at_risk, losses], np.float64)
