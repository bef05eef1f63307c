"""Decision rules of `compare`, `check` and claims: constants, answers and verdicts' conditions.

Every answer is read off the printed interval (`intervals.mean_interval`), so that the two never
contradict each other. A slow test simulates the rules and checks the properties that docs state.
"""

from dataclasses import dataclass, replace
from itertools import combinations
from math import floor, inf, isnan, log10, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trackmark.bench.statistics.intervals import Interval, mean_interval

CONFIDENCE = 0.95
"""Level of all intervals together; m comparisons have intervals at 1 - 0.05 / m (Bonferroni)."""

POWER = 0.80
"""Share of cases in which the advised number of seeds finds a drop."""

POWER_FACTOR = 1.4
"""Share of the expected interval by which a difference must exceed it for this power."""

MARGIN = 0.01
"""Differences of a score up to this are irrelevant in practice (`compare`, `check`)."""

CLAIM_MARGIN = 0.02
"""The same for claims: a fiftieth of the overlap or of a sequence's length."""

DETECT = 0.05
"""Drop of the mean overlap on one sequence that `check` must not miss."""

MIN_UNITS = 6
"""Fewer units give no interval and no answer: six equal signs occur by luck in 3 % of cases."""

MIN_UNITS_FOR_SMALL = 30
"""Fewer units cannot show that a difference is small: 30 units miss a difference that occurs in
one unit of ten in 0.9³⁰ = 4 % of cases."""

MIN_SCENES = 12
"""Scenes that the verdict on a claim needs."""

SHARE_LIMIT = 0.5
"""Limit of a share of scenes unless a claim states another: a paper's figure shows one run, so
that its claim is about the typical scene."""

DEFAULT_SEEDS = 20
"""Seeds per sequence in a baseline."""

MAX_UNITS_ADVISED = 500

Label = Literal["better", "worse", "equivalent", "inconclusive", "identical", "not worse"]


@dataclass(frozen=True)
class Answer:
    """Answer about a mean difference, whose unit is that of the values."""

    label: Label  # `better` if the difference is positive; the last two only of `check`
    mean: float  # NaN without units
    interval: Interval | None = None  # at level 1 - 0.05 / comparisons; None below `MIN_UNITS`
    reason: str = ""  # why the answer is inconclusive
    p: float = nan  # smallest level at which the corrected interval excludes 0
    needed: float = nan  # rough number of units that would decide; NaN if more do not help


def decide(
    differences: ArrayLike,
    margin: float = MARGIN,
    comparisons: int = 1,
    *,
    limit: float = 1.0,
    unit: str = "sequences",
) -> Answer:
    """Answer which of two sides is better by their differences on the same units.

    `differences`: first minus second, shape (n,), positive if the first is better. `margin`:
    differences up to this are irrelevant, 0 or more. `comparisons` share the 5 % of false answers.
    `limit`: largest absolute value of a difference; intervals are cut there. `unit`: plural, for
    reasons.

    Raises `ValueError` if a value is not finite or the margin is negative.
    """
    answer = _answer(differences, margin, comparisons, limit, unit)
    return replace(answer, p=p_value(differences, comparisons)) if answer.interval else answer


def _answer(
    differences: ArrayLike, margin: float, comparisons: int, limit: float, unit: str
) -> Answer:
    """Answer as `decide`, without p."""
    values = np.asarray(differences, np.float64)
    n = len(values)
    if not (np.isfinite(values).all() and margin >= 0):
        raise ValueError(f"differences must be finite and the margin ({margin}) 0 or more.")
    mean = float(values.mean()) if n else nan
    interval = interval_or_none(values, comparisons, -limit, limit)
    label: Label = "inconclusive"
    reason, needed = "", nan
    if interval is None:
        reason = only(n, MIN_UNITS, unit)
    elif interval.inside(margin) and n >= MIN_UNITS_FOR_SMALL:
        label = "equivalent"
    elif interval.inside(margin):
        needed = MIN_UNITS_FOR_SMALL
        reason = f"inside ±{margin:g}, but {only(n, MIN_UNITS_FOR_SMALL, unit)}"
    elif interval.low <= 0 <= interval.high:
        needed = units_needed(mean, interval, n, margin)
        reason = f"interval contains 0; {about(needed)} {unit} needed"
    elif interval.low == interval.high and p_value(values, comparisons) > 1 - CONFIDENCE:
        reason = f"the same difference on all {n} {unit}, too few for {comparisons} comparisons"
    else:
        label = "better" if mean > 0 else "worse"
    return Answer(label, mean, interval, reason, needed=needed)


def interval_or_none(
    values: ArrayLike, comparisons: int = 1, least: float = -inf, most: float = inf
) -> Interval | None:
    """Return the interval of a mean among `comparisons`, or None for fewer than `MIN_UNITS` units.

    `values`: finite, shape (n,), one per unit. `least`, `most`: range of the mean.
    """
    units = np.asarray(values, np.float64)
    if len(units) < MIN_UNITS:
        return None
    low, high = mean_interval(units, corrected_level(comparisons))
    return Interval(min(max(low, least), most), max(min(high, most), least))


def corrected_level(comparisons: int) -> float:
    """Return the level of one interval among `comparisons` that hold together at 95 %."""
    return 1 - (1 - CONFIDENCE) / max(comparisons, 1)


def p_value(differences: ArrayLike, comparisons: int = 1) -> float:
    """Return the smallest level at which the corrected interval still excludes 0.

    If all n differences are one number other than 0, it is 2^(1-n) times the comparisons: the
    probability of n equal signs.
    """
    values = np.asarray(differences, np.float64)
    mean = float(values.mean())
    if mean == 0:
        return 1.0
    if mean_interval(values).low == mean_interval(values).high:
        return min(1.0, comparisons * 2.0 ** (1 - len(values)))
    low, high = 0.0, 1.0  # the interval excludes 0 at `high` or not at all
    for _ in range(50):
        middle = (low + high) / 2
        ends = mean_interval(values, 1 - middle)
        if ends.low > 0 or ends.high < 0:
            high = middle
        else:
            low = middle
    return min(1.0, comparisons * high)


def units_needed(mean: float, interval: Interval, n: int, margin: float) -> float:
    """Return roughly how many units would decide; infinite if no number is likely to.

    In simulation so many new units decide in 86 to 99 % of cases, but from 8 units the quartiles
    of the estimate are a factor of 8 apart.
    """
    low, high = interval
    half = max(mean - low, high - mean)
    if mean != 0:
        half = mean - low if mean > 0 else high - mean
    if abs(mean) > margin:
        return n * (POWER_FACTOR * half / abs(mean)) ** 2
    if abs(mean) == margin:
        return inf
    return max(MIN_UNITS_FOR_SMALL, n + 1, n * (half / (margin - abs(mean))) ** 2)


def about(needed: float) -> str:
    """Return a number of units in words, rounded to two digits.

    >>> about(183.2), about(19.2), about(900.0)
    ('about 180', 'about 19', 'more than 500')
    """
    if isnan(needed) or needed > MAX_UNITS_ADVISED:
        return f"more than {MAX_UNITS_ADVISED}"
    return f"about {round(needed, 1 - floor(log10(needed))):.0f}"


def only(n: int, least: int, unit: str) -> str:
    """Return the reason of an answer for which there are too few units."""
    return f"only {n} of {least} {unit}"


def star_marks(
    values: ArrayLike, margin: float = MARGIN, *, higher: bool = True, limit: float = inf
) -> list[bool]:
    """Return which trackers the star marks: those that `decide`, over all pairs, never calls worse.

    `values`: finite, shape (trackers, units). Fewer than two trackers or `MIN_UNITS` units give no
    marks. `margin` and `limit` are those of `decide`.
    """
    scores = np.atleast_2d(np.asarray(values, np.float64)) * (1 if higher else -1)
    trackers, n = scores.shape
    marks = [trackers > 1 and n >= MIN_UNITS] * trackers
    comparisons = trackers * (trackers - 1) // 2
    for first, second in combinations(range(trackers), 2):
        answer = _answer(scores[first] - scores[second], margin, comparisons, limit, "units")
        if answer.label in ("better", "worse"):
            marks[second if answer.label == "better" else first] = False
    return marks
