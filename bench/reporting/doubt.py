"""How sure a table's means are: their intervals, and whom the data can't tell from the best."""

from collections.abc import Callable, Sequence
from math import isclose, isfinite, nan

import numpy as np
from numpy.typing import NDArray

from bench.statistics.intervals import mean_interval
from bench.statistics.paired import (
    SIGNIFICANCE,
    cells_mean,
    holm,
    scores_interval,
    signed_rank,
)
from reports.tables import Direction, Doubt

__all__ = [
    "LEAST_FOR_NEW",
    "meaning_of_intervals",
    "over_seeds",
    "over_sequences",
    "p_value",
]

LEAST_FOR_NEW = 5
"""Sequences from which on intervals tell of new ones, unless it is said otherwise."""


def meaning_of_intervals(n_sequences: int) -> str:
    """What the intervals of a summary of so many sequences tell of."""
    of = (
        "new sequences like these"
        if n_sequences >= LEAST_FOR_NEW
        else "these sequences with new seeds"
    )
    return f"95 % interval for {of}"


def over_sequences(
    values: Sequence[Sequence[NDArray[np.float64]]], direction: Direction | None
) -> Doubt:
    """Intervals for new sequences like these; pairs by the signed-rank test, corrected by Holm.

    `values`: of the repetitions, by tracker and sequence; see `reports.tables.Doubts`.
    """
    means = np.array([[float(run.mean()) for run in runs] for runs in values])
    halves = [_half(*scores_interval(row)) if np.isfinite(row).all() else nan for row in means]

    def tested(best: int, other: int) -> tuple[float, float, float]:
        differences = means[best] - means[other]
        return (*mean_interval(differences), signed_rank(differences))

    return Doubt(halves, _contenders(means.mean(axis=1), direction, tested))


def over_seeds(
    values: Sequence[Sequence[NDArray[np.float64]]], direction: Direction | None
) -> Doubt:
    """Intervals for these sequences with new seeds; pairs by Welch's test, corrected by Holm."""
    finite = [all(np.isfinite(run).all() for run in runs) for runs in values]
    repeated = [any(len(run) > 1 for run in runs) for runs in values]
    halves = [
        _half(*cells_mean(runs).interval) if known and several else nan
        for runs, known, several in zip(values, finite, repeated, strict=True)
    ]

    def tested(best: int, other: int) -> tuple[float, float, float]:
        found = cells_mean(values[best], values[other])
        return (*found.interval, found.p)

    means = np.array([np.mean([run.mean() for run in runs]) for runs in values])
    return Doubt(halves, _contenders(means, direction, tested))


def p_value(value: float) -> str:
    """A p as papers print it, without the zero before the point."""
    return "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0") if value < 1 else "1"


def _contenders(
    means: NDArray[np.float64],
    direction: Direction | None,
    tested: Callable[[int, int], tuple[float, float, float]],
) -> list[bool]:
    """Whom a test (interval and p) does not tell from the best; nobody where there is no choice.

    The best is found in the same data, so that p is corrected for all pairs, not for its own.
    """
    known = [place for place, mean in enumerate(means.tolist()) if isfinite(mean)]
    if direction is None or len(means) < 2 or not known:
        return [False] * len(means)
    best = (max if direction == "higher" else min)(known, key=lambda place: float(means[place]))
    others = [place for place in known if place != best]
    found = [tested(best, place) for place in others]
    levels = holm([p for _, _, p in found], tests=len(known) * (len(known) - 1) // 2)
    contenders = [place == best for place in range(len(means))]
    for place, (low, high, _), level in zip(others, found, levels.tolist(), strict=True):
        contenders[place] = not (level < SIGNIFICANCE and (low > 0 or high < 0))
    return contenders


def _half(low: float, high: float) -> float:
    """Half the interval's width; none where nothing varied, which is no certainty."""
    return nan if isclose(low, high, rel_tol=1e-9) else (high - low) / 2
