"""Changes of a tracker's score since its baseline, and the drops that its seeds can detect.

Old and new runs are paired by seed. A difference is new minus old score, and positive if better.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from trackmark.bench.statistics.intervals import Interval, mean_interval
from trackmark.bench.statistics.rules import (
    CONFIDENCE,
    LIKELY,
    MARGIN,
    MIN_UNITS,
    POWER,
    POWER_FACTOR,
    Decision,
    are_equal,
    decide,
    in_words,
)

IDENTICAL = Decision("identical", 0.0)


def decide_deterministic(difference: float, margin: float) -> Decision:
    """Judge a deterministic tracker, whose difference has no sampling error."""
    if abs(difference) > margin:
        return Decision("better" if difference > 0 else "worse", difference)
    return Decision("not worse", difference)


def decide_by_seeds(differences: ArrayLike, comparisons: int, detect: float) -> Decision:
    """Judge a stochastic tracker by its differences, shape (seeds,), in the range -1 to 1.

    `comparisons`: number of decisions; the probability that any is false is 5 %. `detect`: drop to
    detect.
    """
    decision = decide(differences, MARGIN, comparisons, unit="seeds")
    interval = decision.interval
    if interval is None or decision.label in ("better", "worse"):
        return decision
    if interval.low > -detect:
        return replace(decision, label="not worse", reason="", needed=None)
    if are_equal(differences):
        return replace(decision, label="inconclusive", needed=None)
    likely = mean_interval(differences, LIKELY)
    needed = _seeds_needed(decision.mean, interval, likely, np.size(differences), detect)
    reason = in_words(needed, "seeds")
    return replace(decision, label="inconclusive", reason=reason, needed=needed)


def _seeds_needed(
    mean: float, interval: Interval, likely: Interval, seeds: int, detect: float
) -> Interval:
    """Return the range of seeds that would show a drop, or exclude one as large as `detect`.

    The range belongs to the true drops in `likely`; a drop of half of `detect` needs the most.
    """
    above, below = interval.high - mean, mean - interval.low

    def number(drop: float) -> float:
        ratios = [above / drop] if drop > 0 else []
        ratios += [below / (detect - drop)] if drop < detect else []
        return max(seeds + 1, ceil(seeds * (POWER_FACTOR * min(ratios)) ** 2))

    drops = [-likely.high, -mean, -likely.low]
    hardest = above / (above + below) * detect
    drops += [hardest] if drops[0] < hardest < drops[2] else []
    numbers = [number(drop) for drop in drops]
    return Interval(min(numbers), max(numbers))


def pooled_spread(scores: Sequence[ArrayLike]) -> float:
    """Return the root mean square over sequences of the standard deviation over seeds."""
    return sqrt(float(np.mean([np.var(np.asarray(values), ddof=1) for values in scores])))


def advised_seeds(spread: float, sequences: int, detect: float) -> int:
    """Return the number of seeds that detects a drop on one sequence in 80 % of cases."""
    seeds = 2 * (spread * _n_standard_errors(sequences) / detect) ** 2 + 2
    return max(MIN_UNITS, ceil(seeds))


def detectable_drops(spread: float, sequences: int, seeds: int) -> tuple[float, float]:
    """Return the drops on one sequence and of the mean that are detected in 80 % of cases."""
    on_sequence = spread * _n_standard_errors(sequences) * sqrt(2 / seeds)
    return on_sequence, spread * _n_standard_errors(1) * sqrt(2 / (seeds * sequences))


def _n_standard_errors(sequences: int) -> float:
    """Return the size of a drop that is detected in 80 % of cases, in standard errors."""
    tail = (1 - CONFIDENCE) / 2 / sequences
    return float(ndtri(1 - tail) + ndtri(POWER))
