"""Psychometric threshold: the difficulty at which half of the runs survive.

A difficulty is a number from 0, the easy end of a range, to 1, the hard end. The probability of
survival falls with the difficulty x along a logistic curve, luck + (1 - lapse - luck) / (1 + exp((x
- m) / s)). `lapse` is the share of runs that fail at any difficulty, `luck` the share that fail at
none. The threshold is the difficulty at which the curve is one half; it is not the middle m if
lapse and luck differ. Its posterior is computed on a grid of the four parameters m, s, lapse and
luck (as in psignifit), without iteration.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval

Array = NDArray[np.float64]

N_FIRST_RUNS, N_NEXT_RUNS = 20, 10
"""Numbers of runs in the first batch (evenly spread over the range) and in each further batch."""

MAX_EXCESS = 0.5
"""Largest distance of a threshold from the range [widths of the range]."""


@dataclass(frozen=True, eq=False)
class Threshold:
    """Posterior of a threshold, which can be outside [0, 1]."""

    weights: Array  # weights of the curves in the grid; their sum is 1

    def quantile(self, share: float) -> float:
        """Return a quantile of the threshold's posterior, for a probability in (0, 1)."""
        order, thresholds = _grid().order, _grid().thresholds
        reached = np.searchsorted(self._cumulated, share)
        return float(thresholds[order[min(int(reached), len(order) - 1)]])

    @property
    def median(self) -> float:
        """Median of the posterior."""
        return self.quantile(0.5)

    @property
    def interval(self) -> Interval:
        """Interval that contains the threshold with a probability of 95 %."""
        return Interval(self.quantile(0.025), self.quantile(0.975))

    @property
    def half_width(self) -> float:
        """Half of the width of the interval."""
        return (self.interval.high - self.interval.low) / 2

    def survival(self, difficulties: ArrayLike) -> Array:
        """Return the posterior mean of the survival probability at each difficulty, shape (n,)."""
        values = np.asarray(difficulties).tolist()
        return np.array([self.weights @ _grid().survival(x) for x in values])

    @cached_property
    def _cumulated(self) -> Array:
        return np.cumsum(self.weights[_grid().order])


def threshold(difficulties: ArrayLike, survived: ArrayLike) -> Threshold:
    """Estimate a threshold from the difficulties of independent runs and their survival."""
    x, survived = np.asarray(difficulties, np.float64), np.asarray(survived, bool)
    likelihood = _grid().prior.copy()
    for difficulty in np.unique(x).tolist():
        outcomes = survived[x == difficulty]
        chance = _grid().survival(difficulty)
        likelihood += outcomes.sum() * np.log(chance) + (~outcomes).sum() * np.log1p(-chance)
    weights = np.exp(likelihood - likelihood.max())
    return Threshold(weights / weights.sum())


def next_difficulties(
    posterior: Threshold, generator: np.random.Generator, count: int = N_NEXT_RUNS
) -> Array:
    """Return random difficulties of the next runs in [0, 1], shape (count,).

    The posterior is divided into `count` parts of equal probability; each part contains one
    difficulty. The estimate then depends least on the shape of the curve.
    """
    shares = (np.arange(count) + generator.uniform(0, 1, count)) / count
    return np.clip([posterior.quantile(share) for share in shares.tolist()], 0.0, 1.0)


class _Grid(NamedTuple):
    """Grid of logistic curves; each field has shape (curves,)."""

    middles: Array
    slopes: Array  # s; the curve falls from 90 % to 10 % over a distance of 4.4 times s
    lapses: Array
    lucks: Array
    prior: Array  # logarithm of the prior
    thresholds: Array
    order: NDArray[np.int64]  # indices that sort the thresholds

    def survival(self, difficulty: float) -> Array:
        """Return the probability of survival at a difficulty for each curve."""
        falling = 1 / (1 + np.exp((difficulty - self.middles) / self.slopes))
        chance = self.lucks + (1 - self.lapses - self.lucks) * falling
        return np.asarray(np.clip(chance, 1e-4, 1 - 1e-4))


@cache
def _grid() -> _Grid:
    middles = np.linspace(-MAX_EXCESS, 1 + MAX_EXCESS, 151)
    slopes = np.geomspace(0.01, 0.4, 10)
    shares = np.array([0.01, 0.05, 0.12, 0.22, 0.4])
    axes = np.meshgrid(middles, slopes, shares, shares, indexing="ij")
    middle, slope, lapse, luck = (axis.ravel() for axis in axes)
    # Small lapse and luck are more likely a priori: density of Beta(1, 10), as in psignifit.
    width = np.gradient(shares)
    prior = 9 * np.log1p(-lapse) + 9 * np.log1p(-luck)
    prior += np.log(width[np.searchsorted(shares, lapse)] * width[np.searchsorted(shares, luck)])
    half = (0.5 - luck) / (1 - lapse - luck)  # height of the logistic part at survival 0.5
    thresholds = middle + slope * np.log(1 / half - 1)
    return _Grid(
        middle, slope, lapse, luck, prior, thresholds, np.argsort(thresholds, kind="stable")
    )
