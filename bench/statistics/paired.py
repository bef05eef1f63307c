"""Two trackers on the same sequences: what their paired differences show.

A difference is one tracker's score minus the other's on one sequence, each averaged over its
repetitions first. Sequences are the unit of evidence: frames of one sequence follow from each
other, and a test that pools them calls equal trackers different in 70 to 85 % of cases.
"""

from collections.abc import Sequence
from math import ceil, inf, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri, stdtr

from bench.statistics.intervals import Interval, t_quantile, wilson_interval

__all__ = [
    "SIGNIFICANCE",
    "CellsMean",
    "cells_mean",
    "cells_needed",
    "critical_difference",
    "holm",
    "probability_better",
    "scores_interval",
    "signed_rank",
    "smallest_p",
]

SIGNIFICANCE = 0.05
POWER = 0.80


def signed_rank(differences: ArrayLike) -> float:
    """Exact two-sided p of Wilcoxon's signed-rank test, ties and all.

    Differences of zero say nothing of a direction and are left out; where none is left, p is 1.
    The distribution over all signs is convolved from the ranks, so that equal differences (two
    trackers that are both lost) need no approximation.

    Parameters
    ----------
    differences : array of float, shape (n,)
        One a sequence, in any unit.

    Examples
    --------
    >>> signed_rank([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    0.03125
    """
    given = np.asarray(differences, np.float64)
    # The order of a sum changes its last digits, and with them what is equal.
    scale = np.abs(given).max(initial=0.0)
    steps = np.round(given / scale, 12) if scale > 0 else given
    steps = steps[steps != 0]
    _, places, ties = np.unique(np.abs(steps), return_inverse=True, return_counts=True)
    ranks = (2 * np.cumsum(ties) - ties + 1)[places]  # twice: ties have half ranks
    probability = np.ones(1)
    for rank in ranks:
        shifted = np.zeros(len(probability) + rank)
        shifted[: len(probability)] = probability
        shifted[rank:] += probability
        probability = shifted / 2
    above = int(ranks[steps > 0].sum())
    tail = min(probability[: above + 1].sum(), probability[above:].sum())
    return min(1.0, 2 * float(tail))


def smallest_p(cells: int) -> float:
    """Smallest p that a signed-rank test of so many sequences can reach: 2 / 2ⁿ."""
    return min(1.0, 2.0 ** (1 - cells))


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


def probability_better(differences: ArrayLike, confidence: float = 0.95) -> tuple[float, Interval]:
    """Probability that the first tracker is better on a new sequence, with Wilson's interval.

    It is the share of positive differences, (n,); a tie counts half.
    """
    given = np.asarray(differences, np.float64)
    share = float((given > 0).mean() + (given == 0).mean() / 2)
    return share, wilson_interval(share, len(given), confidence)


class CellsMean(NamedTuple):
    """Mean over given cells, its interval and two-sided p of zero, were they run again."""

    mean: float
    interval: Interval
    p: float


def cells_mean(
    first: Sequence[ArrayLike], second: Sequence[ArrayLike] = (), confidence: float = 0.95
) -> CellsMean:
    """Mean over *these* cells, and how it may vary were they run again with new seeds.

    Each cell's mean errs by its spread over repetitions alone; Student's t with the degrees of
    freedom of Welch and Satterthwaite.

    Parameters
    ----------
    first : sequence of array of float, shapes (r_i,)
        Values of the repetitions, by cell. A cell with one repetition is one that never draws:
        run again it would give the same.
    second : sequence of array of float
        Another tracker's on the same cells: the mean is then that of the differences.
    confidence : float
        Nominal coverage in (0, 1).
    """
    groups = [np.asarray(group, np.float64) for group in (*first, *second)]
    means = np.array([group.mean() for group in groups])
    mean = float(means[: len(first)].mean() - (means[len(first) :].mean() if second else 0.0))
    drawn = [group for group in groups if len(group) > 1 and np.ptp(group) > 0]
    if not drawn:
        return CellsMean(mean, Interval(mean, mean), float(mean == 0.0))
    squares = np.array([group.var(ddof=1) / len(group) for group in drawn])
    parts = squares**2 / np.array([len(group) - 1 for group in drawn])
    degrees = float(squares.sum() ** 2 / parts.sum())
    error = sqrt(squares.sum()) / len(first)
    half = t_quantile(degrees, confidence) * error
    p = 2 * float(stdtr(degrees, -abs(mean) / error))
    return CellsMean(mean, Interval(mean - half, mean + half), p)


def scores_interval(scores: ArrayLike) -> Interval:
    """95 % interval of a tracker's mean score for new sequences, from one score a sequence.

    Student's t with one degree of freedom less than usual: scores pile up at both ends of their
    range, or half of them are near nothing, and the usual interval covers too little then.

    Parameters
    ----------
    scores : array of float, shape (n,)
        n of 2 or more.
    """
    values = np.asarray(scores, np.float64)
    mean, error = float(values.mean()), float(values.std(ddof=1)) / sqrt(len(values))
    half = t_quantile(max(len(values) - 2, 1), 0.95) * error
    return Interval(mean - half, mean + half)


def cells_needed(difference: float, deviation: float, margin: float, tests: int = 1) -> float:
    """About how many sequences would settle a difference that can't be told yet.

    Where it is larger than the margin: as many as show it in `POWER` of cases at `SIGNIFICANCE`,
    shared among the tests; where it is smaller: as many as bring its interval within the margin,
    as surely. For normal differences; never fewer than a signed-rank test needs at all.

    Parameters
    ----------
    difference, deviation, margin : float
        Mean and standard deviation of the differences, and what means nothing in practice; one
        unit.
    tests : int
        How many comparisons share the significance.
    """
    level = SIGNIFICANCE / tests
    least = ceil(1 - np.log2(level))
    quantile = float(ndtri(1 - level / 2))
    room = margin - abs(difference)
    if room < 0:
        steps = (quantile + float(ndtri(POWER))) * deviation / abs(difference)
        # Of normal differences the ranks use 3/π; and few values give no normal quantile but t's.
        needed = steps**2 * pi / 3 + quantile**2 / 2
    else:
        # Both ends of the interval must lie within, so that each may miss in half as many cases.
        reach = float(ndtri(1 - SIGNIFICANCE / 2)) + float(ndtri((1 + POWER) / 2))
        needed = (reach * deviation / room) ** 2 if room > 0 else inf
    return float(max(least, ceil(needed))) if np.isfinite(needed) else inf


def critical_difference(trackers: int, cells: int) -> float:
    """Nemenyi's critical difference of mean ranks at 5 %: below it, two ranks can't be told apart.

    As Demšar (2006) gives it: q √(k (k + 1) / 6 N), q from the studentised range of k trackers.

    Examples
    --------
    >>> round(critical_difference(4, 14), 2)  # Demšar's example
    1.25
    """
    from scipy.stats import studentized_range  # half a second, for `compare` alone

    quantile = float(studentized_range.ppf(1 - SIGNIFICANCE, trackers, inf)) / sqrt(2)
    return quantile * sqrt(trackers * (trackers + 1) / (6 * cells))
