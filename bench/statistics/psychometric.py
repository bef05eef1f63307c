"""A psychometric threshold: where, along a range, half of the runs survive.

A place in the range is a number from 0, its easy end, to 1, its hard end. The chance to survive
falls with the place x along a logistic curve, luck + (1 - lapse - luck) / (1 + exp((x - m) / s)):
`lapse` is the share that is lost however easy it is, `luck` the share that is never lost. The
threshold is where the curve is one half, so that it means the same whatever these are. Its
posterior is summed over a grid of all four numbers (as psignifit does): nothing has to converge.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval

Array = NDArray[np.float64]

FIRST, NEXT = 20, 10
"""Runs that are placed evenly over the range, and runs that are placed at a time from then on."""

BEYOND = 0.5
"""How far outside the range thresholds are thought possible, in ranges."""


@dataclass(frozen=True, eq=False)
class Threshold:
    """What runs tell of a threshold: places are in ranges, and may lie outside [0, 1]."""

    weights: Array  # of the grid's curves, which sum to 1

    def quantile(self, share: float) -> float:
        """Place below which the threshold lies with this probability, in (0, 1)."""
        order, places = _grid().order, _grid().thresholds
        reached = np.searchsorted(self._cumulated, share)
        return float(places[order[min(int(reached), len(order) - 1)]])

    @property
    def place(self) -> float:
        """The threshold: the median of its posterior."""
        return self.quantile(0.5)

    @property
    def interval(self) -> Interval:
        """Where it lies with a probability of 95 %."""
        return Interval(self.quantile(0.025), self.quantile(0.975))

    @property
    def half_width(self) -> float:
        """Half of the interval's width."""
        return (self.interval.high - self.interval.low) / 2

    def survival(self, places: ArrayLike) -> Array:
        """Share that survives at each place, shape (n,): the mean of the posterior."""
        return np.array([self.weights @ _grid().survival(x) for x in np.asarray(places).tolist()])

    @cached_property
    def _cumulated(self) -> Array:
        return np.cumsum(self.weights[_grid().order])


def threshold(places: ArrayLike, survived: ArrayLike) -> Threshold:
    """Estimate a threshold from independent runs.

    `places`: of the runs, in ranges. `survived`: which of them survived.
    """
    x, kept = np.asarray(places, np.float64), np.asarray(survived, bool)
    likelihood = _grid().prior.copy()
    for place in np.unique(x).tolist():
        here = kept[x == place]
        chance = _grid().survival(place)
        likelihood += here.sum() * np.log(chance) + (~here).sum() * np.log1p(-chance)
    weights = np.exp(likelihood - likelihood.max())
    return Threshold(weights / weights.sum())


def next_places(now: Threshold, generator: np.random.Generator, count: int = NEXT) -> Array:
    """Where the next runs tell most, in [0, 1], shape (count,).

    At the threshold as far as it is known, one in each equal share of its posterior: what is
    learnt there depends least on the shape of the curve.
    """
    shares = (np.arange(count) + generator.uniform(0, 1, count)) / count
    return np.clip([now.quantile(share) for share in shares.tolist()], 0.0, 1.0)


class _Grid(NamedTuple):
    """Curves that are thought possible, all of shape (curves,)."""

    middles: Array
    slopes: Array  # s: from 10 % to 90 % the curve takes 4.4 s
    lapses: Array
    lucks: Array
    prior: Array  # logarithm
    thresholds: Array
    order: NDArray[np.int64]  # of the thresholds

    def survival(self, place: float) -> Array:
        """Chance to survive there."""
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
    # Of lapses and luck smaller ones are likelier: density of Beta(1, 10), as psignifit has it.
    width = np.gradient(shares)
    prior = 9 * np.log1p(-lapse) + 9 * np.log1p(-luck)
    prior += np.log(width[np.searchsorted(shares, lapse)] * width[np.searchsorted(shares, luck)])
    half = (0.5 - luck) / (1 - lapse - luck)  # of the way down, where one half survives
    places = middle + slope * np.log(1 / half - 1)
    return _Grid(middle, slope, lapse, luck, prior, places, np.argsort(places, kind="stable"))
