"""How sure a table's means are: their intervals, and whom the data can't tell from the best."""

from collections.abc import Callable, Sequence
from itertools import combinations
from math import isclose, isfinite, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.statistics.intervals import Interval, mean_interval
from bench.statistics.paired import (
    SIGNIFICANCE,
    cells_mean,
    holm,
    scores_interval,
    signed_rank,
)
from reports.tables import Doubt, Measure

__all__ = [
    "LEAST_FOR_NEW",
    "Answer",
    "answer_of",
    "best_of",
    "bounded_difference",
    "bounded_score",
    "meaning_of_intervals",
    "over_seeds",
    "over_sequences",
    "p_value",
]

LEAST_FOR_NEW = 5
"""Sequences from which on intervals tell of new ones, unless it is said otherwise."""


Answer = Literal["better", "worse", "practically equal", "cannot tell"]
"""Of two trackers the first, by a measure."""


def answer_of(
    interval: Interval | None, adjusted: float, margin: float, direction: str | None
) -> Answer:
    """Equal where the interval of the difference says so; better where test and interval both do.

    `adjusted`: p after the correction for all pairs. `margin`: difference that means nothing in
    practice. `direction`: which score is better, `higher` or `lower`.
    """
    if interval is None:
        return "cannot tell"
    if interval.inside(margin):
        return "practically equal"
    if adjusted < SIGNIFICANCE and (interval.low > 0 or interval.high < 0):
        return "better" if (interval.low > 0) == (direction == "higher") else "worse"
    return "cannot tell"


def meaning_of_intervals(n_sequences: int) -> str:
    """What the intervals of a summary of so many sequences tell of."""
    of = (
        "new sequences like these"
        if n_sequences >= LEAST_FOR_NEW
        else "these sequences with new seeds"
    )
    return f"95 % interval for {of}"


def bounded_score(measure: Measure, scores: ArrayLike) -> Interval:
    """95 % interval of a mean score for new sequences, as far as the measure goes."""
    return scores_interval(scores).within(measure.least, measure.most)


def bounded_difference(measure: Measure, differences: ArrayLike) -> Interval:
    """95 % interval of a mean difference of scores, as far as the measure goes."""
    widest = measure.most - measure.least
    return mean_interval(differences).within(-widest, widest)


def over_sequences(values: Sequence[Sequence[NDArray[np.float64]]], measure: Measure) -> Doubt:
    """Intervals for new sequences like these; pairs by the signed-rank test, corrected by Holm.

    `values`: of the repetitions, by tracker and sequence; see `reports.tables.Doubts`.
    """
    means = np.array([[float(run.mean()) for run in runs] for runs in values])
    halves = [_half(*scores_interval(row)) if np.isfinite(row).all() else nan for row in means]

    def tested(first: int, second: int) -> tuple[Interval, float]:
        differences = means[first] - means[second]
        return mean_interval(differences), signed_rank(differences)

    return Doubt(halves, _contenders(means.mean(axis=1), measure, tested))


def over_seeds(values: Sequence[Sequence[NDArray[np.float64]]], measure: Measure) -> Doubt:
    """Intervals for these sequences with new seeds; pairs by Welch's test, corrected by Holm.

    Where nothing was repeated nothing can be told, and the best means alone are named.
    """
    finite = [all(np.isfinite(run).all() for run in runs) for runs in values]
    repeated = [any(len(run) > 1 for run in runs) for runs in values]
    halves = [
        _half(*cells_mean(runs).interval) if known and several else nan
        for runs, known, several in zip(values, finite, repeated, strict=True)
    ]

    def tested(first: int, second: int) -> tuple[Interval, float]:
        found = cells_mean(values[first], values[second])
        return found.interval, found.p

    means = np.array([np.mean([run.mean() for run in runs]) for runs in values])
    if any(repeated):
        return Doubt(halves, _contenders(means, measure, tested))
    return Doubt(halves, best_of(means.tolist(), measure))


def best_of(means: Sequence[float], measure: Measure) -> list[bool]:
    """Which means are the best one, but for rounding; none where there is no choice."""
    known = [mean for mean in means if isfinite(mean)]
    if measure.direction is None or len(means) < 2 or not known:
        return [False] * len(means)
    best = max(known) if measure.direction == "higher" else min(known)
    return [isclose(mean, best, rel_tol=1e-9, abs_tol=1e-12) for mean in means]


def p_value(value: float) -> str:
    """A p as papers print it, without the zero before the point."""
    return "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0") if value < 1 else "1"


def _contenders(
    means: NDArray[np.float64],
    measure: Measure,
    tested: Callable[[int, int], tuple[Interval, float]],
) -> list[bool]:
    """Whom tests (interval and p) do not tell from the best; nobody where there is no choice.

    The same answers as `compare` gives: p is corrected for all pairs, as the best is found in the
    same data, and who is practically equal to the best is not behind it.
    """
    known = [place for place, mean in enumerate(means.tolist()) if isfinite(mean)]
    if measure.direction is None or len(means) < 2 or not known:
        return [False] * len(means)
    chosen = max if measure.direction == "higher" else min
    best = chosen(known, key=lambda place: float(means[place]))
    pairs = [*combinations(known, 2)]
    found = [tested(*pair) for pair in pairs]
    levels = holm([p for _, p in found]).tolist()
    behind = set()
    for pair, (interval, _), level in zip(pairs, found, levels, strict=True):
        answer = answer_of(interval, level, measure.margin, measure.direction)
        if best in pair and answer in ("better", "worse"):
            behind.add(pair[answer == "better"])
    return [place in known and place not in behind for place in range(len(means))]


def _half(low: float, high: float) -> float:
    """Half the interval's width; none where nothing varied, which is no certainty."""
    return nan if isclose(low, high, rel_tol=1e-9) else (high - low) / 2
