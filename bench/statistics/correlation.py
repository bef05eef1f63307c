"""Agreement of two rankings: Spearman's rank correlation with its interval."""

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

    The variance of z is (1 + r²/2) / (n - 3), by Bonett and Wright. Few pairs can agree perfectly
    by chance. For the interval, |r| is therefore limited to 1 - s / 2, where 1 - s is the largest
    correlation of imperfect agreement. The interval is [-1, 1] with fewer than `MIN_UNITS` pairs.
    The correlation is NaN if one side is constant. Infinite values have the last rank.
    """
    a, b = rankdata(first), rankdata(second)
    n = len(a)
    if n < 2 or not (np.ptp(a) and np.ptp(b)):
        return nan, Interval(-1.0, 1.0)
    r = float(np.corrcoef(a, b)[0, 1])
    if n < MIN_UNITS:
        return r, Interval(-1.0, 1.0)
    max_r = 1 - 6 / (n * (n * n - 1))
    clipped = min(max(r, -max_r), max_r)
    half = float(ndtri((1 + confidence) / 2)) * sqrt((1 + clipped * clipped / 2) / (n - 3))
    return r, Interval(tanh(atanh(clipped) - half), tanh(atanh(clipped) + half))
