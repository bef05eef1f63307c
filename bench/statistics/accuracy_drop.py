"""Changes of a tracker's score against its baseline, and what a number of seeds can detect.

Runs before and now are paired by seed; a difference is now minus before, positive if better.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, nan, sqrt
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from bench.statistics.intervals import Interval
from bench.statistics.rules import CONFIDENCE, MARGIN, MIN_UNITS, POWER, about, decide

ChangeLabel = Literal["identical", "better", "not worse", "inconclusive", "worse"]

_POWER_FACTOR = 1.4
"""Share of the expected interval by which a difference must exceed it for a power of 80 %."""


@dataclass(frozen=True)
class Change:
    """Change of a score.

    Attributes
    ----------
    label : {'identical', 'better', 'not worse', 'inconclusive', 'worse'}
        Answer.
    difference : float
        Now minus before.
    interval : Interval or None
        Interval of the difference; None if it is a fact.
    p : float
        Smallest corrected level at which the interval excludes 0; NaN without an interval.
    reason : str
        Why the answer is inconclusive; empty otherwise.
    needed : float
        Rough number of seeds that would decide; NaN if the answer is conclusive.
    """

    label: ChangeLabel
    difference: float = 0.0
    interval: Interval | None = None
    p: float = nan
    reason: str = ""
    needed: float = nan


IDENTICAL = Change("identical")


def fact(difference: float, margin: float) -> Change:
    """Judge a tracker without randomness, whose difference has no sampling error."""
    if abs(difference) > margin:
        return Change("better" if difference > 0 else "worse", difference)
    return Change("not worse", difference)


def seed_change(differences: ArrayLike, comparisons: int, detect: float) -> Change:
    """Judge a tracker by its differences, shape (seeds,), in the range -1 to 1.

    `comparisons`: number of answers that share the false ones. `detect`: drop that must not be
    missed.
    """
    answer = decide(differences, MARGIN, comparisons, unit="seeds")
    mean, interval = answer.mean, answer.interval
    if answer.label in ("better", "worse"):
        return Change(answer.label, mean, interval, answer.p)
    if interval is None:
        return Change("inconclusive", mean, None, reason=answer.reason, needed=MIN_UNITS)
    if interval.low > -detect:
        return Change("not worse", mean, interval, answer.p)
    if interval.low == interval.high:
        return Change("inconclusive", mean, interval, answer.p, answer.reason)
    needed = seeds_needed(mean, interval, np.size(differences), detect)
    reason = f"{about(needed)} seeds needed"
    return Change("inconclusive", mean, interval, answer.p, reason, needed)


def seeds_needed(mean: float, interval: Interval, seeds: int, detect: float) -> float:
    """Return roughly how many seeds would show a drop, or rule out one of `detect`."""
    ratios = []
    if mean < 0:
        ratios.append((interval.high - mean) / -mean)
    if mean > -detect:
        ratios.append((mean - interval.low) / (mean + detect))
    return max(seeds + 1, ceil(seeds * (_POWER_FACTOR * min(ratios)) ** 2))


def pooled_spread(scores: Sequence[ArrayLike]) -> float:
    """Return the root mean square of the sequences' standard deviations over seeds."""
    return sqrt(float(np.mean([np.var(np.asarray(values), ddof=1) for values in scores])))


def advised_seeds(spread: float, sequences: int, detect: float) -> int:
    """Return the number of seeds that finds a drop of `detect` on one sequence in 80 % of cases."""
    seeds = 2 * (spread * _steps(sequences) / detect) ** 2 + 2
    return max(MIN_UNITS, ceil(seeds))


def detectable_drops(spread: float, sequences: int, seeds: int) -> tuple[float, float]:
    """Return the drops on one sequence and in the mean that are found in 80 % of cases."""
    on_sequence = spread * _steps(sequences) * sqrt(2 / seeds)
    return on_sequence, spread * _steps(1) * sqrt(2 / (seeds * sequences))


def _steps(sequences: int) -> float:
    """Return the standard errors by which a drop must exceed 0 to be found in 80 % of cases."""
    tail = (1 - CONFIDENCE) / 2 / sequences
    return float(ndtri(1 - tail) + ndtri(POWER))
