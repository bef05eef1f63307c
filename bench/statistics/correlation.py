"""Agreement of two orders: Spearman's rank correlation with its interval."""

from math import atanh, nan, sqrt, tanh

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata

from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import MIN_UNITS


def rank_correlation(
    first: ArrayLike, second: ArrayLike, confidence: float = 0.95
) -> tuple[float, Interval]:
    """Return Spearman's correlation of n pairs, and its interval by Fisher's z.

    The variance of z is Bonett and Wright's, (1 + r²/2) / (n - 3). A perfect agreement of few pairs
    is not certain: for the interval, r is at most half of the smallest step away from ±1. With
    fewer than `MIN_UNITS` pairs the interval is [-1, 1]. Without any spread r is NaN. Infinities
    are the last of an order.
    """
    a, b = rankdata(first), rankdata(second)
    n = len(a)
    if n < 2 or not (np.ptp(a) and np.ptp(b)):
        return nan, Interval(-1.0, 1.0)
    r = float(np.corrcoef(a, b)[0, 1])
    if n < MIN_UNITS:
        return r, Interval(-1.0, 1.0)
    most = 1 - 6 / (n * (n * n - 1))
    held = min(max(r, -most), most)
    half = float(ndtri((1 + confidence) / 2)) * sqrt((1 + held * held / 2) / (n - 3))
    return r, Interval(tanh(atanh(held) - half), tanh(atanh(held) + half))
