"""Decision rules of `compare`, `check` and claims, with their constants.

Each decision follows from the printed interval (`intervals.mean_interval`), so that decision and
interval never contradict each other. A slow test simulates the rules and checks the properties that
docs/ states.
"""

from dataclasses import dataclass
from itertools import combinations
from math import floor, inf, isnan, log10, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trackmark.bench.statistics.intervals import Interval, mean_interval

CONFIDENCE = 0.95
"""Joint confidence level of all intervals; each of m has the level 1 - 0.05 / m (Bonferroni)."""

POWER = 0.80
"""Share of cases in which the advised number of seeds detects a drop."""

POWER_FACTOR = 1.4
"""Ratio of a difference to the expected half width of its interval at which the power is 80 %."""

MARGIN = 0.01
"""Largest difference of a score that is irrelevant in practice (`compare`, `check`)."""

CLAIM_MARGIN = 0.02
"""Largest irrelevant difference of claims: a fiftieth of the overlap or of a sequence's length."""

DETECT = 0.05
"""Drop of the mean overlap on one sequence that `check` must detect."""

MIN_UNITS = 6
"""Minimum number of units for an interval: six equal signs occur by chance in 3 % of cases."""

MIN_UNITS_FOR_SMALL = 30
"""Minimum number of units that can show that a difference is small. If one unit of ten has a large
difference, 30 units contain none of these in 0.9³⁰ = 4 % of cases.
"""

MIN_SCENES = 12
"""Minimum number of scenes for a verdict on a claim."""

SHARE_LIMIT = 0.5
"""Default limit of a share of scenes. A paper's figure shows one run, which should be typical: what
it shows must occur in most scenes.
"""

DEFAULT_SEEDS = 20
"""Number of seeds per sequence in a baseline."""

MAX_UNITS_ADVISED = 500

Label = Literal["better", "worse", "equivalent", "inconclusive", "identical", "not worse"]


@dataclass(frozen=True)
class Decision:
    """Decision about a mean difference, in the unit of the values."""

    label: Label  # the last two labels are used only by `check`
    mean: float  # mean difference; NaN without units
    interval: Interval | None = None  # at level 1 - 0.05 / comparisons; None below `MIN_UNITS`
    reason: str = ""  # reason of an inconclusive decision
    needed: float = nan  # rough number of units for a decision; NaN if more do not help


def decide(
    differences: ArrayLike,
    margin: float = MARGIN,
    comparisons: int = 1,
    *,
    limit: float = 1.0,
    unit: str = "sequences",
) -> Decision:
    """Decide which of two sides is better by their differences on the same units.

    `differences`: first minus second, shape (n,), positive if the first is better. `margin`:
    largest irrelevant difference, 0 or more. `comparisons`: number of comparisons; the probability
    that any decision is false is 5 %. `limit`: largest possible absolute difference, at which
    intervals are clipped. `unit`: name of the units in the plural, for the reason.

    Raises `ValueError` if a value is not finite or the margin is negative.
    """
    values = np.asarray(differences, np.float64)
    n = len(values)
    if not (np.isfinite(values).all() and margin >= 0):
        raise ValueError(
            f"Expected: finite differences and a margin of 0 or more (it is {margin})."
        )
    mean = float(values.mean()) if n else nan
    interval = interval_or_none(values, comparisons, -limit, limit)
    label: Label = "inconclusive"
    reason, needed = "", nan
    if interval is None:
        reason = too_few(n, MIN_UNITS, unit)
    elif interval.inside(margin) and n >= MIN_UNITS_FOR_SMALL:
        label = "equivalent"
    elif interval.inside(margin):
        needed = MIN_UNITS_FOR_SMALL
        reason = f"inside ±{margin:g}, but {too_few(n, MIN_UNITS_FOR_SMALL, unit)}"
    elif interval.low <= 0 <= interval.high:
        needed = units_needed(mean, interval, n, margin)
        reason = f"interval contains 0; {approximate(needed)} {unit} needed"
    elif interval.low == interval.high and p_value(values, comparisons) > 1 - CONFIDENCE:
        reason = f"the same difference on all {n} {unit}, too few for {comparisons} comparisons"
    else:
        label = "better" if mean > 0 else "worse"
    return Decision(label, mean, interval, reason, needed)


def interval_or_none(
    values: ArrayLike, comparisons: int = 1, least: float = -inf, most: float = inf
) -> Interval | None:
    """Return the interval of a mean, or None for fewer than `MIN_UNITS` units.

    `values`: finite, shape (n,), one per unit. `least`, `most`: range of the mean.
    """
    units = np.asarray(values, np.float64)
    if len(units) < MIN_UNITS:
        return None
    low, high = mean_interval(units, corrected_level(comparisons))
    return Interval(min(max(low, least), most), max(min(high, most), least))


def corrected_level(comparisons: int) -> float:
    """Return the level of each of several intervals whose joint level is 95 %."""
    return 1 - (1 - CONFIDENCE) / max(comparisons, 1)


def p_value(differences: ArrayLike, comparisons: int = 1) -> float:
    """Return the smallest level at which the corrected interval still excludes 0.

    If all n differences are equal and not 0, it is 2^(1-n), the probability of n equal signs, times
    the number of comparisons.
    """
    values = np.asarray(differences, np.float64)
    mean = float(values.mean())
    if mean == 0:
        return 1.0
    if mean_interval(values).low == mean_interval(values).high:
        return min(1.0, comparisons * 2.0 ** (1 - len(values)))
    low, high = 0.0, 1.0  # if the interval excludes 0 at any level, it does so at `high`
    for _ in range(50):
        middle = (low + high) / 2
        ends = mean_interval(values, 1 - middle)
        if ends.low > 0 or ends.high < 0:
            high = middle
        else:
            low = middle
    return min(1.0, comparisons * high)


def units_needed(mean: float, interval: Interval, n: int, margin: float) -> float:
    """Estimate how many units suffice for a decision; infinite if no number is likely to.

    In simulation this number of new units suffices in 86 to 99 % of cases. The estimate is rough:
    from 8 units its quartiles differ by a factor of 8.
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


def approximate(needed: float) -> str:
    """Return a number of units in words, rounded to two digits.

    >>> approximate(183.2), approximate(19.2), approximate(900.0)
    ('about 180', 'about 19', 'more than 500')
    """
    if isnan(needed) or needed > MAX_UNITS_ADVISED:
        return f"more than {MAX_UNITS_ADVISED}"
    return f"about {round(needed, 1 - floor(log10(needed))):.0f}"


def too_few(n: int, minimum: int, unit: str) -> str:
    """Return the reason of an inconclusive decision: there are too few units."""
    return f"only {n} of {minimum} {unit}"


def star_marks(
    values: ArrayLike, margin: float = MARGIN, *, higher: bool = True, limit: float = inf
) -> list[bool]:
    """Return which trackers get a star: those that are not `worse` by `decide` in any pair.

    `values`: finite, shape (trackers, units). Fewer than two trackers or `MIN_UNITS` units give no
    marks. `margin` and `limit` are those of `decide`.
    """
    scores = np.atleast_2d(np.asarray(values, np.float64)) * (1 if higher else -1)
    trackers, n = scores.shape
    marks = [trackers > 1 and n >= MIN_UNITS] * trackers
    comparisons = trackers * (trackers - 1) // 2
    for first, second in combinations(range(trackers), 2):
        difference = scores[first] - scores[second]
        decision = decide(difference, margin, comparisons, limit=limit)
        if decision.label in ("better", "worse"):
            marks[second if decision.label == "better" else first] = False
    return marks
