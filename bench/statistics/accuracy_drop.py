"""Changes of a tracker's score against its baseline, and what a number of seeds can detect.

Runs before and now are paired by seed; a difference is now minus before, positive if better.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, nan, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import (
    CONFIDENCE,
    MARGIN,
    MIN_UNITS,
    POWER,
    POWER_FACTOR,
    Answer,
    about,
    decide,
)

IDENTICAL = Answer("identical", 0.0)


def fact(difference: float, margin: float) -> Answer:
    """Judge a tracker without randomness, whose difference has no sampling error."""
    if abs(difference) > margin:
        return Answer("better" if difference > 0 else "worse", difference)
    return Answer("not worse", difference)


def seed_change(differences: ArrayLike, comparisons: int, detect: float) -> Answer:
    """Judge a tracker by its differences, shape (seeds,), in the range -1 to 1.

    `comparisons`: number of answers that share the false ones. `detect`: drop that must not be
    missed.
    """
    answer = decide(differences, MARGIN, comparisons, unit="seeds")
    interval = answer.interval
    if interval is None or answer.label in ("better", "worse"):
        return answer
    if interval.low > -detect:
        return replace(answer, label="not worse", reason="", needed=nan)
    if interval.low == interval.high:
        return replace(answer, label="inconclusive", needed=nan)
    needed = _seeds_needed(answer.mean, interval, np.size(differences), detect)
    reason = f"{about(needed)} seeds needed"
    return replace(answer, label="inconclusive", reason=reason, needed=needed)


def _seeds_needed(mean: float, interval: Interval, seeds: int, detect: float) -> float:
    """Return roughly how many seeds would show a drop, or rule out one of `detect`."""
    ratios = []
    if mean < 0:
        ratios.append((interval.high - mean) / -mean)
    if mean > -detect:
        ratios.append((mean - interval.low) / (mean + detect))
    return max(seeds + 1, ceil(seeds * (POWER_FACTOR * min(ratios)) ** 2))


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
