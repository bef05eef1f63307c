"""Intervals: of a mean over cells, of shares, of one more run, of an interaction.

A cell is one sequence in one scene; repetitions have been averaged before. So there are few
values, and intervals that count on many (a percentile bootstrap, say) cover too little.
"""

from math import cbrt, exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaln, ndtri, stdtrit

__all__ = [
    "Interval",
    "difference_interval",
    "hall_interval",
    "mean_interval",
    "odds_ratio",
    "prediction_interval",
    "share_interval",
    "t_quantile",
    "wilson_interval",
]

RESAMPLES = 2000

INDEPENDENT = [0.0003, 0.0006, 0.0012, 0.0025, 0.005, 0.01]
"""Intraclass correlations that only hundreds of trials a cell tell from none."""

ALIKE = np.array([*INDEPENDENT, 0.02, 0.05, *np.arange(0.1, 0.95, 0.1), 0.95, 0.99])
"""Intraclass correlations that `share_interval` thinks of."""

BEFOREHAND = np.full(len(ALIKE), 1.0)
BEFOREHAND[: len(INDEPENDENT)], BEFOREHAND[-1] = 32.0 / len(INDEPENDENT), 16.0
"""How likely it takes each of them to be, in proportion: trials that are independent, or all alike,
are no rare cases. Chosen by the simulation that tests it, so that it covers as nominally as it can
in both."""

BEYOND = 0.018
"""Of the posterior, what is left out at either end, chosen likewise."""


class Interval(NamedTuple):
    """From `low` to `high`, both in the unit of the values."""

    low: float
    high: float

    def inside(self, margin: float) -> bool:
        """Whether it lies wholly in ± margin."""
        return -margin <= self.low and self.high <= margin

    def within(self, least: float, most: float) -> "Interval":
        """What of it lies in a range that the estimated mean can't leave."""
        return Interval(min(max(self.low, least), most), max(min(self.high, most), least))


def mean_interval(values: ArrayLike, confidence: float = 0.95) -> Interval:
    """Student's t interval of a mean.

    At nominal 95 % it covers 93 to 96 % over 8 or 20 cells of normal, U-shaped and half-lost
    populations; over 5 cells it falls to 92 % where half are lost. The bootstrap-t covers 94 to
    99 % there, is wider, and needs random numbers. A test simulates both.

    Parameters
    ----------
    values : array of float, shape (n,)
        One value a cell, n of 2 or more.
    confidence : float
        Nominal coverage in (0, 1).

    Raises
    ------
    ValueError
        For fewer than two values or one that is not finite.

    Examples
    --------
    >>> low, high = mean_interval([1.0, 2.0, 3.0])
    >>> print(f"{low:.3f} {high:.3f}")
    -0.484 4.484
    """
    cells = _checked(values)
    half = t_quantile(len(cells) - 1, confidence) * _standard_error(cells)
    mean = float(cells.mean())
    return Interval(mean - half, mean + half)


def hall_interval(values: ArrayLike) -> Interval:
    """95 % interval of the mean of what may be skewed: the one that verdicts use.

    Student's t after Hall's transformation (J. R. Statist. Soc. B 54, 1992), which takes out what
    the sample's skewness does to it. Over 8, 20 and 32 cells it covers 95 % of normal, 97 to 98 %
    of U-shaped, 96 to 99 % of half-lost and 94 to 95 % of exponential populations (Student's t: 90
    to 93 % of these); the exponential's mean is above it in 6, 4 and 3 %. Where everything depends
    on one scene of ten, it covers 56, 87 and 95 %: in 43, 12 and 3 % of cases there is none among
    those drawn, and no interval could tell. A test simulates that.

    Parameters, errors: see `mean_interval`.
    """
    cells = _checked(values)
    n, mean, error = len(cells), float(cells.mean()), _standard_error(cells)
    if error == 0.0:
        return Interval(mean, mean)
    off = cells - mean
    skew = float((off**3).mean() / (off**2).mean() ** 1.5) / sqrt(n)
    ends = (t_quantile(n - 1, 0.95) * sign for sign in (1.0, -1.0))
    if abs(skew) < 1e-6:  # where the transformation only rounds
        low, high = (mean - error * end for end in ends)
    else:
        low, high = (
            mean - error * 3 / skew * (cbrt(1 + skew * (end - skew / 6)) - 1) for end in ends
        )
    return Interval(low, high)


def prediction_interval(values: ArrayLike, confidence: float = 0.95) -> Interval:
    """Where one more value of the same (normal) population falls: mean ± t s √(1 + 1/n).

    Parameters, errors: see `mean_interval`.
    """
    cells = _checked(values)
    deviation = float(cells.std(ddof=1)) * sqrt(1 + 1 / len(cells))
    half = t_quantile(len(cells) - 1, confidence) * deviation
    mean = float(cells.mean())
    return Interval(mean - half, mean + half)


def difference_interval(
    first: ArrayLike,
    second: ArrayLike,
    generator: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = RESAMPLES,
) -> Interval:
    """Bootstrap-t interval of mean(first) - mean(second), two groups of cells without pairs.

    With paired differences as values it is the interval of an interaction.

    Parameters
    ----------
    first, second : array of float, shapes (m,) and (n,)
        One value a cell, two or more of each.
    generator : Generator
        Draws the resamples, of each group on its own.
    confidence : float
        Nominal coverage in (0, 1).
    resamples : int
        How many. One without spread counts as infinitely far off, unless it is right on the
        mean; where so many are that a quantile would be infinite, the interval is.

    Raises
    ------
    ValueError
        For fewer than two values in a group or one that is not finite.
    """
    groups = [_checked(first), _checked(second)]
    signs = (1, -1)
    mean = sum(sign * float(group.mean()) for sign, group in zip(signs, groups, strict=True))
    error = sqrt(sum(_standard_error(group) ** 2 for group in groups))
    if error == 0.0:
        return Interval(mean, mean)
    shift = np.full(resamples, -mean)
    square = np.zeros(resamples)
    for sign, group in zip(signs, groups, strict=True):
        n = len(group)
        drawn = group[generator.integers(0, n, (resamples, n))]
        shift += sign * drawn.mean(axis=1)
        square += drawn.var(axis=1, ddof=1) / n
    # Rounding leaves a spread of 1e-17 where there is none.
    flat = square < (1e-12 * error) ** 2
    far = np.where(np.abs(shift) < 1e-12 * error, 0.0, np.copysign(np.inf, shift))
    ratios = np.sort(np.where(flat, far, shift / np.sqrt(np.where(flat, 1.0, square))))
    tail = (1 - confidence) / 2
    lowest = int(np.floor(tail * resamples))
    return Interval(
        float(mean - error * ratios[resamples - 1 - lowest]), float(mean - error * ratios[lowest])
    )


def share_interval(successes: ArrayLike, trials: ArrayLike) -> Interval:
    """95 % interval of a share, from counts a cell whose trials may fare alike.

    Cells are drawn from a beta distribution, and trials from their cell's share. How alike the
    trials of a cell fare (the intraclass correlation) is not known, least where all of them
    succeed: the interval is that of the posterior over shares and correlations, flat in the
    share. Over 8 to 32 cells at a share of .75 it covers 95 to 98 %, whether trials are independent
    or cells are all or nothing, and has the truth above or below it in 3 %; where trials are a
    little alike (.02) it covers 94 to 96 %, with up to 4 % on a side, and likewise of a thousand
    trials a cell at .95. At .6 it covers 95 to 98 %. At .9 it covers 96 to 98 %, with the truth
    above it in up to 4 % where trials are much alike: of so few cells, counts and ends go in steps.
    A test simulates that.

    Parameters
    ----------
    successes, trials : array of int, shape (n_cells,)
        Counts a cell; trials of 1 or more.

    Examples
    --------
    >>> print("{:.2f} {:.2f}".format(*share_interval([20] * 20, [20] * 20)))
    0.84 1.00
    """
    counts = np.stack([np.asarray(successes, np.float64), np.asarray(trials, np.float64)])
    (good, runs), times = np.unique(counts, axis=1, return_counts=True)
    edges = np.linspace(0.0, 1.0, 101)
    below = _share_below(edges, good, runs, times)
    # Once more where the share lies: of many trials, between two or three of these edges.
    first = max(int(np.searchsorted(below, 1e-6)) - 2, 0)
    last = min(int(np.searchsorted(below, 1 - 1e-6)) + 1, len(edges) - 1)
    edges = np.linspace(edges[first], edges[last], 301)
    below = _share_below(edges, good, runs, times)
    low, high = np.interp([BEYOND, 1 - BEYOND], below, edges)
    return Interval(float(low) if good.any() else 0.0, float(high) if (good < runs).any() else 1.0)


def odds_ratio(
    trials: NDArray[np.float64],
    successes: NDArray[np.float64],
    other_trials: NDArray[np.float64],
    other_successes: NDArray[np.float64],
) -> tuple[float, Interval]:
    """How many times as high the odds of a success are in trials as in others, over all cells.

    The 95 % interval is that of a jackknife over cells, of the logarithm. Where many cells have no
    other trials, only those that have count for its quantile. A half is added to all four sums of
    successes and failures, so that no odds are infinite. Of cells as unlike as a beta distribution
    makes them it covers 94 to 96 % at a ratio of 5, over 40 cells of which 8 to 40 have other
    trials; at a ratio of 20 the truth is below it in 7 to 12 %.

    Parameters
    ----------
    trials, successes, other_trials, other_successes : array of float, shape (n_cells,)
        Counts a cell, two cells or more.
    """
    cells = np.stack(
        [successes, trials - successes, other_successes, other_trials - other_successes]
    )
    every = cells.sum(axis=1, keepdims=True)
    logs = np.log(np.hstack([every, every - cells]) + 0.5)
    whole, *without = (logs[0] - logs[1] - logs[2] + logs[3]).tolist()
    degrees = max(int((other_trials > 0).sum()) - 1, 1)
    half = t_quantile(degrees, 0.95) * float(np.std(without)) * sqrt(len(without) - 1)
    return exp(whole), Interval(exp(whole - half), exp(whole + half))


def _share_below(
    edges: NDArray[np.float64],
    good: NDArray[np.float64],
    runs: NDArray[np.float64],
    times: NDArray[np.int_],
) -> NDArray[np.float64]:
    """How likely the share is below each of these edges, if it is between the first and the last.

    Cells have `good` successes of `runs`, so many `times`.
    """
    shares = (edges[:-1] + edges[1:]) / 2
    sizes = (1 - ALIKE) / ALIKE  # of both parameters of a beta distribution together
    first, second = np.outer(shares, sizes)[..., None], np.outer(1 - shares, sizes)[..., None]
    logs = betaln(good + first, runs - good + second) - betaln(first, second)
    likelihood = (logs * times).sum(axis=-1) + np.log(BEFOREHAND)
    posterior = np.exp(likelihood - likelihood.max()).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(posterior) / posterior.sum()])


def wilson_interval(share: float, trials: float, confidence: float = 0.95) -> Interval:
    """Wilson's score interval of a share.

    Parameters
    ----------
    share : float
        Observed share in [0, 1].
    trials : float
        How many independent trials it was observed in, above 0; need not be whole.
    confidence : float
        Nominal coverage in (0, 1).

    Examples
    --------
    >>> print("{:.4f} {:.4f}".format(*wilson_interval(0.9, 20)))
    0.6990 0.9721
    """
    if not (0 <= share <= 1 and trials > 0):
        raise ValueError(f"a share of {share} in {trials} trials: give 0 to 1, and more than none.")
    square = float(ndtri((1 + confidence) / 2)) ** 2
    centre = (share + square / (2 * trials)) / (1 + square / trials)
    spread = sqrt(square * (share * (1 - share) + square / (4 * trials)) / trials)
    half = spread / (1 + square / trials)
    return Interval(max(0.0, centre - half), min(1.0, centre + half))


def _checked(values: ArrayLike) -> NDArray[np.float64]:
    cells = np.asarray(values, np.float64)
    if cells.ndim != 1 or len(cells) < 2:
        raise ValueError(f"an interval needs two or more values in a row, not {cells.shape}.")
    if not np.isfinite(cells).all():
        raise ValueError("an interval needs finite values.")
    return cells


def _standard_error(cells: NDArray[np.float64]) -> float:
    return float(cells.std(ddof=1)) / sqrt(len(cells))


def t_quantile(degrees: float, confidence: float) -> float:
    """Student's t that a value stays within, to either side, with this confidence."""
    return float(stdtrit(degrees, (1 + confidence) / 2))
