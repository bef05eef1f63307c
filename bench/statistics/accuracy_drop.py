"""Changes of a tracker's score since its baseline, and the drops that its repetitions can detect.

Old and new runs are paired by repetition. A difference is new minus old score, so that it is
positive if the tracker became better.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, floor, inf, isfinite, log10, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval, interval_ends, mean_interval
from trackmark.bench.statistics.rules import (
    CONFIDENCE,
    EQUAL,
    LIKELY,
    MARGIN,
    MIN_UNITS,
    POWER,
    POWER_FACTOR,
    Decision,
    are_all_equal,
    corrected_level,
    decide,
    in_words,
)

MAX_REPETITIONS = 10_000
"""Maximum number of repetitions of a baseline."""

N_CHECKS = 2000
"""Number of simulated checks: the standard error of a share of 80 % is 0.9 %."""

_MAX_VALUES = 500_000  # of an array; with more than 250 repetitions, fewer checks are simulated
_MAX_TRIALS = 8

IDENTICAL = Decision("identical", 0.0)


def decide_deterministic(difference: float, margin: float) -> Decision:
    """Judge a deterministic tracker, whose difference has no sampling error."""
    if abs(difference) > margin:
        return Decision("better" if difference > 0 else "worse", difference)
    return Decision("not worse", difference)


def decide_by_repetitions(
    differences: ArrayLike, comparisons: int, detectable_drop: float
) -> Decision:
    """Decide on the change of a stochastic tracker, a drop of `detectable_drop` being relevant.

    `differences` has one value per repetition, in the range -1 to 1. `comparisons` is the number of
    decisions; the probability that any of them is false is 5 %.
    """
    decision = decide(differences, MARGIN, comparisons, unit="repetitions")
    interval = decision.interval
    if interval is None or decision.label in ("better", "worse"):
        return decision
    if interval.low > -detectable_drop:
        return replace(decision, label="not worse", reason="", needed=None)
    if are_all_equal(differences):
        return replace(decision, label="inconclusive", needed=None)
    likely = mean_interval(differences, LIKELY)
    needed = _repetitions_needed(
        decision.mean, interval, likely, np.size(differences), detectable_drop
    )
    reason = in_words(needed, "repetitions")
    return replace(decision, label="inconclusive", reason=reason, needed=needed)


def _repetitions_needed(
    mean: float, interval: Interval, likely: Interval, n_repetitions: int, detectable_drop: float
) -> Interval:
    """Return the range of repetitions that would show a drop, or exclude `detectable_drop`.

    The range belongs to the true drops in `likely`; half of `detectable_drop` needs the most.
    """
    above, below = interval.high - mean, mean - interval.low

    def needed_for(drop: float) -> float:
        ratios = [above / drop] if drop > 0 else []
        ratios += [below / (detectable_drop - drop)] if drop < detectable_drop else []
        return max(n_repetitions + 1, ceil(n_repetitions * (POWER_FACTOR * min(ratios)) ** 2))

    drops = [-likely.high, -mean, -likely.low]
    hardest = above / (above + below) * detectable_drop
    drops += [hardest] if drops[0] < hardest < drops[2] else []
    needed = [needed_for(drop) for drop in drops]
    return Interval(min(needed), max(needed))


def missed_drops(
    scores: Sequence[ArrayLike], n_repetitions: int, comparisons: int, *, in_mean: bool = False
) -> NDArray[np.float64]:
    """Simulate checks; return for each the largest drop that the rule does not call worse.

    Old and new scores are drawn from the deviations of the repetitions from their mean on a
    sequence, all with new random numbers. A check draws one of the sequences, or their mean with
    `in_mean`. The result is infinite if the rule finds no drop of any size. Its shape is (checks,).

    `scores`: scores of a tracker's repetitions, one array of two or more per sequence.
    `n_repetitions`: number of repetitions of the simulated checks. `comparisons`: see
    `decide_by_repetitions`.
    """
    generator = np.random.default_rng(0)  # equal baselines print equal lines
    checks = min(N_CHECKS, max(N_CHECKS // 10, _MAX_VALUES // n_repetitions))
    deviations = [_deviations(np.asarray(values, np.float64)) for values in scores]
    sides = (checks, n_repetitions, 2)
    if in_mean:
        total = np.zeros((checks, n_repetitions))
        for values in deviations:
            drawn = generator.choice(values, sides)
            total += drawn[..., 0] - drawn[..., 1]
        differences = total / len(deviations)
    else:
        sequence = np.sort(generator.integers(len(deviations), size=checks))
        counts = np.bincount(sequence, minlength=len(deviations)).tolist()
        drawn = np.concatenate(
            [
                generator.choice(values, (count, *sides[1:]))
                for values, count in zip(deviations, counts, strict=True)
            ]
        )
        differences = drawn[..., 0] - drawn[..., 1]
    # A drop moves the interval: it is found if the interval is then below 0 and not inside ±margin.
    low, high = interval_ends(differences, corrected_level(comparisons))
    missed: NDArray[np.float64] = np.maximum(high, low + MARGIN)
    if comparisons * 2.0 ** (1 - n_repetitions) > 1 - CONFIDENCE:
        missed[np.ptp(differences, axis=-1) <= EQUAL] = (
            inf  # equal differences on too few repetitions
        )
    return missed


def _deviations(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the deviations from the mean, with the variance of the population."""
    deviations: NDArray[np.float64] = values - values.mean()
    return deviations * sqrt(len(values) / (len(values) - 1))


def share_found(missed: NDArray[np.float64], drop: float) -> float:
    """Return the share of simulated checks (`missed_drops`) that find a drop."""
    return float(np.mean(missed < drop))


def found_drop(missed: NDArray[np.float64]) -> float:
    """Return the smallest drop, with two digits, that 80 % of simulated checks find.

    It is at least the margin, and infinite if no drop is found so often.
    """
    drop = max(float(np.quantile(missed, POWER, method="higher")), MARGIN)
    if not isfinite(drop):
        return inf
    unit = 10.0 ** (floor(log10(drop)) - 1)
    rounded = ceil(drop / unit - 1e-9) * unit
    return rounded if share_found(missed, rounded) >= POWER else rounded + unit


def advised_repetitions(
    scores: Sequence[ArrayLike], n_repetitions: int, comparisons: int, detectable_drop: float
) -> int | None:
    """Return the number of repetitions that finds a drop on one sequence in 80 % of checks.

    The result is None if `MAX_REPETITIONS` do not suffice, or if the drop is below the margin.
    `n_repetitions`: number from which the search starts. Other parameters: see `missed_drops`.
    """
    sufficient = None
    for _ in range(_MAX_TRIALS if detectable_drop >= MARGIN else 0):
        missed = missed_drops(scores, n_repetitions, comparisons)
        share = share_found(missed, detectable_drop)
        if share >= POWER:
            sufficient = min(n_repetitions, sufficient or n_repetitions)
        if POWER <= share < POWER + 0.02 or (share >= POWER and n_repetitions == MIN_UNITS):
            break
        drop = float(np.quantile(missed, POWER, method="higher"))
        # Intervals are about as wide as the inverse root of the number of repetitions.
        factor = (drop / detectable_drop) ** 2 if isfinite(drop) else 2.0
        following = min(max(MIN_UNITS, ceil(n_repetitions * factor)), MAX_REPETITIONS)
        if following == n_repetitions:
            break
        n_repetitions = following
    return sufficient
