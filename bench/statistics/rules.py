"""Decision rules of `compare`, `check` and claims, with their constants.

Each decision follows from the printed interval (`intervals.mean_interval`), so that decision and
interval never contradict each other. A slow test simulates the rules and checks the properties that
docs/ states.
"""

from dataclasses import dataclass
from math import ceil, floor, inf, isfinite, log, log10, nan
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from trackmark.bench.statistics.intervals import Interval, interval_ends, mean_interval

CONFIDENCE = 0.95
"""Joint confidence level of all intervals; each of m has the level 1 - 0.05 / m (Bonferroni)."""

POWER = 0.80
"""Share of cases in which the advised number of repetitions detects a drop."""

POWER_FACTOR = 1.4
"""Ratio of a difference to the expected half width of its interval at which the power is 80 %."""

MARGIN = 0.01
"""Largest difference of a score that is irrelevant in practice (`compare`, `check`)."""

CLAIM_MARGIN = 0.02
"""Largest irrelevant difference of claims: a fiftieth of the overlap or of a sequence's length."""

MIN_UNITS = 6
"""Minimum number of units for an interval: six equal signs occur by chance in 3 % of cases."""

RARE_DIFFERENCE = 0.3
"""Difference of a score, from 0 to 1, on a sequence that only one of two trackers loses."""

MIN_UNITS_FOR_SMALL = 44
"""Minimum number of units that can show that a difference is small, of measures above 1."""

RARE_SHARE = 0.05
"""Share of the units in the warning on rare large differences."""

MIN_SCENES = 12
"""Minimum number of scenes for a verdict on a claim."""

SHARE_LIMIT = 0.5
"""Default limit of a share of scenes. A paper's figure shows one run, which should be typical: what
it shows must occur in most scenes.
"""

LIKELY = 0.5
"""Confidence level of the differences from which a range of numbers of units is computed."""

MIN_RELATIVE_DIFFERENCE = 0.25
"""Lower end of these differences, relative to the mean, below which there is no estimate."""

EQUAL = 1e-6
"""Largest distance of differences that count as equal: the rounding of stored scores."""

T = TypeVar("T")

Label = Literal["better", "worse", "equivalent", "inconclusive", "identical", "not worse"]


@dataclass(frozen=True)
class Decision:
    """Decision about a mean difference, in the unit of the values."""

    label: Label  # the last two labels are used only by `check`
    mean: float  # mean difference; NaN without units
    interval: Interval | None = None  # at level 1 - 0.05 / comparisons; None below `MIN_UNITS`
    reason: str = ""  # reason of an inconclusive decision
    needed: Interval | None = None  # range of numbers of units for a decision; None if unknown


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
    reason, needed = "", None
    enough = units_for_small(margin, limit)
    if interval is None:
        reason = too_few(n, MIN_UNITS, unit)
    elif interval.inside(margin) and n >= enough:
        label = "equivalent"
    elif interval.inside(margin):
        needed = Interval(enough, enough) if isfinite(enough) else None
        reason = f"inside ±{margin:g}; {missed_if_rare(n, unit)}"
    elif interval.low <= 0 <= interval.high:
        likely = mean_interval(values, LIKELY)
        needed = units_needed(mean, interval, likely, n, margin, enough)
        reason = f"interval contains 0; {in_words(needed, unit)}"
    elif are_all_equal(values) and p_value(values, comparisons) > 1 - CONFIDENCE:
        reason = f"the same difference on all {n} {unit}, too few for {comparisons} comparisons"
    else:
        label = "better" if mean > 0 else "worse"
    return Decision(label, mean, interval, reason, needed)


def interval_or_none(
    values: ArrayLike, comparisons: int = 1, minimum: float = -inf, maximum: float = inf
) -> Interval | None:
    """Return the interval of a mean, or None for fewer than `MIN_UNITS` units.

    `values`: finite, shape (n,), one per unit. `minimum`, `maximum`: range of the mean.
    """
    units = np.asarray(values, np.float64)
    if len(units) < MIN_UNITS:
        return None
    low, high = mean_interval(units, corrected_level(comparisons))
    return Interval(min(max(low, minimum), maximum), max(min(high, maximum), minimum))


def corrected_level(comparisons: int) -> float:
    """Return the level of each of several intervals whose joint level is 95 %."""
    return 1 - (1 - CONFIDENCE) / max(comparisons, 1)


def are_all_equal(differences: ArrayLike) -> bool:
    """Return whether all differences are equal within the rounding of stored scores."""
    return bool(np.ptp(np.asarray(differences, np.float64)) <= EQUAL)


def p_value(differences: ArrayLike, comparisons: int = 1) -> float:
    """Return the smallest level at which the corrected interval still excludes 0.

    If all n differences are equal (`are_all_equal`), it is 2^(1-n), the probability of n equal
    signs, times the number of comparisons; it is 1 if they are equal to 0.
    """
    values = np.asarray(differences, np.float64)
    mean = float(values.mean())
    if are_all_equal(values):
        return 1.0 if abs(mean) <= EQUAL else min(1.0, comparisons * 2.0 ** (1 - len(values)))
    if mean == 0:
        return 1.0
    low, high = 0.0, 1.0  # if the interval excludes 0 at any level, it does so at `high`
    for _ in range(50):
        middle = (low + high) / 2
        ends = mean_interval(values, 1 - middle)
        if ends.low > 0 or ends.high < 0:
            high = middle
        else:
            low = middle
    return min(1.0, comparisons * high)


def units_for_small(margin: float, limit: float = 1.0) -> float:
    """Return the number of units that can show that a difference is inside the margin.

    A mean difference of `margin` can come from the share `margin` / `RARE_DIFFERENCE` of the units,
    while all others are equal. So many units contain none of these in 5 % of cases. The result is
    infinite for a margin of 0. For a measure whose differences can be larger than 1 (`limit`), such
    as pixels or a number of clips, it is `MIN_UNITS_FOR_SMALL`.
    """
    if limit > 1:
        return MIN_UNITS_FOR_SMALL
    if margin >= RARE_DIFFERENCE:
        return MIN_UNITS
    if margin == 0:
        return inf
    return max(MIN_UNITS, ceil(log(1 - CONFIDENCE) / log(1 - margin / RARE_DIFFERENCE)))


def missed_if_rare(n: int, unit: str) -> str:
    """Return how often n units contain none of the rare units with a large difference.

    >>> missed_if_rare(30, "sequences")
    'a difference on 1 sequence in 20 would be missed in 21 %'
    """
    singular = "family" if unit == "families" else unit.removesuffix("s")
    share = 100 * (1 - RARE_SHARE) ** n
    return f"a difference on 1 {singular} in {1 / RARE_SHARE:.0f} would be missed in {share:.0f} %"


def units_needed(
    mean: float,
    interval: Interval,
    likely: Interval,
    n: int,
    margin: float,
    enough: float = MIN_UNITS,
) -> Interval | None:
    """Return the range of numbers of units that suffice for a decision; None without an estimate.

    The ends of the range belong to the ends of `likely`, the interval of the mean at the level
    `LIKELY`. There is no estimate if the interval of the absolute mean begins below a quarter of
    the absolute mean. docs/comparing.md states how often the ends suffice on published scores.

    `interval`: printed interval of n units. `enough`: number of units that can show that the
    difference is inside the margin.
    """
    size, half = abs(mean), mean - interval.low if mean > 0 else interval.high - mean
    sizes = (likely.low, likely.high) if mean > 0 else (-likely.high, -likely.low)
    if sizes[0] <= MIN_RELATIVE_DIFFERENCE * size:
        return None
    needed = [_units_needed(value, half, n, margin, enough) for value in (*sizes, size)]
    return Interval(min(needed), max(needed)) if isfinite(max(needed)) else None


def _units_needed(size: float, half: float, n: int, margin: float, enough: float) -> float:
    """Return a number of units that suffices for a mean of `size`; `half`: its half width now.

    The interval is inside the margin before it excludes 0 if its half width, `size` /
    `POWER_FACTOR`, is at most the distance of `size` from the margin.
    """
    if size / POWER_FACTOR > margin - size:
        return n * (POWER_FACTOR * half / size) ** 2
    return max(enough, n + 1, n * (half / (margin - size)) ** 2)


def in_words(needed: Interval | None, unit: str) -> str:
    """Return the range of numbers of units in words, rounded to two digits.

    >>> in_words(Interval(28.8, 153.1), "sequences"), in_words(None, "scenes")
    ('29 to 150 sequences needed', 'no estimate of the scenes needed')
    """
    if needed is None:
        return f"no estimate of the {unit} needed"
    low, high = (round(value, 1 - floor(log10(value))) for value in needed)
    return f"{low:.0f} to {high:.0f} {unit} needed" if low < high else f"{low:.0f} {unit} needed"


def too_few(n: int, minimum: int, unit: str) -> str:
    """Return the reason of an inconclusive decision: there are too few units."""
    return f"only {n} of {minimum} {unit}"


def star_marks(
    values: ArrayLike, margin: float = MARGIN, *, higher: bool = True, limit: float = inf
) -> list[bool]:
    """Return which trackers get a star: those that no other is `better` than, over all pairs.

    `values`: finite, shape (trackers, units). Fewer than two trackers or `MIN_UNITS` units give no
    marks. `margin` and `limit` are those of `decide`.
    """
    scores = np.atleast_2d(np.asarray(values, np.float64)) * (1 if higher else -1)
    trackers, n = scores.shape
    if trackers < 2 or n < MIN_UNITS:
        return [False] * trackers
    n_pairs = trackers * (trackers - 1) // 2
    beaten = set[int | None]()
    for first in range(trackers - 1):
        differences = scores[first] - scores[first + 1 :]
        low, high = interval_ends(differences, corrected_level(n_pairs))
        # `decide` takes much longer than the intervals of all pairs of a tracker. It is only needed
        # for intervals without 0, and `EQUAL` is above their rounding error.
        for pair in np.flatnonzero(~((low < -EQUAL) & (high > EQUAL))).tolist():
            second = first + 1 + pair
            if (second if differences[pair].mean() > 0 else first) not in beaten:
                decision = decide(differences[pair], margin, n_pairs, limit=limit)
                beaten.add(loser_of(first, second, decision))
    return [tracker not in beaten for tracker in range(trackers)]


def loser_of(first: T, second: T, decision: Decision) -> T | None:
    """Return which side is worse by the decision on `first` minus `second`; None if neither."""
    return {"better": second, "worse": first}.get(decision.label)
