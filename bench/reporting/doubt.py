"""Former rules of comparisons, which `bench.comparing` uses until it has the shared ones."""

from collections.abc import Sequence
from math import isclose, isfinite
from typing import Literal

from numpy.typing import ArrayLike

from bench.statistics.intervals import Interval, mean_interval
from bench.statistics.paired import SIGNIFICANCE, scores_interval
from reports.tables import Measure

LEAST_FOR_NEW = 5

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


def bounded_score(measure: Measure, scores: ArrayLike) -> Interval:
    """95 % interval of a mean score for new sequences, as far as the measure goes."""
    return scores_interval(scores).within(measure.least, measure.most)


def bounded_difference(measure: Measure, differences: ArrayLike) -> Interval:
    """95 % interval of a mean difference of scores, as far as the measure goes."""
    widest = measure.most - measure.least
    return mean_interval(differences).within(-widest, widest)


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
