"""Psychometric threshold: the place along a range at which half of the runs survive.

A place is a number from 0, the easy end of the range, to 1, the hard end. The probability to
survive falls with the place x along a logistic curve, luck + (1 - lapse - luck) / (1 + exp((x - m)
/ s)): `lapse` is the share of runs that fail at any place, `luck` the share that never fail. The
threshold is the place where the curve is one half, so that it does not depend on these shares. Its
posterior is summed over a grid of all four numbers (as in psignifit): nothing has to converge.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval

Array = NDArray[np.float64]

FIRST, NEXT = 20, 10
"""Runs that are placed evenly over the range first, and runs per further batch."""

BEYOND = 0.5
"""Largest distance of a threshold from the range, in ranges."""


@dataclass(frozen=True, eq=False)
class Threshold:
    """Posterior of a threshold; places may lie outside [0, 1]."""

    weights: Array  # of the grid's curves, which sum to 1

    def quantile(self, share: float) -> float:
        """Return the place below which the threshold lies with this probability, in (0, 1)."""
        order, places = _grid().order, _grid().thresholds
        reached = np.searchsorted(self._cumulated, share)
        return float(places[order[min(int(reached), len(order) - 1)]])

    @property
    def place(self) -> float:
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

    def survival(self, places: ArrayLike) -> Array:
        """Return the posterior mean of the share that survives at each place, shape (n,)."""
        return np.array([self.weights @ _grid().survival(x) for x in np.asarray(places).tolist()])

    @cached_property
    def _cumulated(self) -> Array:
        return np.cumsum(self.weights[_grid().order])


def threshold(places: ArrayLike, survived: ArrayLike) -> Threshold:
    """Estimate a threshold from the places of independent runs, and whether each survived."""
    x, kept = np.asarray(places, np.float64), np.asarray(survived, bool)
    likelihood = _grid().prior.copy()
    for place in np.unique(x).tolist():
        here = kept[x == place]
        chance = _grid().survival(place)
        likelihood += here.sum() * np.log(chance) + (~here).sum() * np.log1p(-chance)
    weights = np.exp(likelihood - likelihood.max())
    return Threshold(weights / weights.sum())


def next_places(now: Threshold, generator: np.random.Generator, count: int = NEXT) -> Array:
    """Return places of the next runs in [0, 1], shape (count,).

    There is one in each equal share of the threshold's posterior: the estimate then depends least
    on the shape of the curve.
    """
    shares = (np.arange(count) + generator.uniform(0, 1, count)) / count
    return np.clip([now.quantile(share) for share in shares.tolist()], 0.0, 1.0)


class _Grid(NamedTuple):
    """Possible curves; every field has shape (curves,)."""

    middles: Array
    slopes: Array  # s: from 10 % to 90 % the curve takes 4.4 s
    lapses: Array
    lucks: Array
    prior: Array  # logarithm
    thresholds: Array
    order: NDArray[np.int64]  # of the thresholds

    def survival(self, place: float) -> Array:
        """Return the probability of every curve to survive at a place."""
        falling = 1 / (1 + np.exp((place - self.middles) / self.slopes))
        chance = self.lucks + (1 - self.lapses - self.lucks) * falling
        return np.asarray(np.clip(chance, 1e-4, 1 - 1e-4))


@cache
def _grid() -> _Grid:
    middles = np.linspace(-BEYOND, 1 + BEYOND, 151)
    slopes = np.geomspace(0.01, 0.4, 10)
    shares = np.array([0.01, 0.05, 0.12, 0.22, 0.4])
    axes = np.meshgrid(middles, slopes, shares, shares, indexing="ij")
    middle, slope, lapse, luck = (axis.ravel() for axis in axes)
    # Small lapses and luck are more likely: density of Beta(1, 10), as in psignifit.
    width = np.gradient(shares)
    prior = 9 * np.log1p(-lapse) + 9 * np.log1p(-luck)
    prior += np.log(width[np.searchsorted(shares, lapse)] * width[np.searchsorted(shares, luck)])
    half = (0.5 - luck) / (1 - lapse - luck)  # of the curve's fall, at which one half survives
    places = middle + slope * np.log(1 / half - 1)
    return _Grid(middle, slope, lapse, luck, prior, places, np.argsort(places, kind="stable"))
