"""Rules that judge claims: pure functions of one value per scene.

    order(differences)               "A is better than B"; differences are A - B.
    no_worse(differences)            "A is as good as B, or better".
    share(succeeded, limit)          "X happens in most scenes".
    conjunction(parts)               A claim with several parts, all of which must hold.
    at_floor, at_ceiling             Whether a comparison cannot show anything on these scenes.

Each verdict follows from its printed interval (`rules`). Differences and margins have the same
unit. With enough scenes a rule decides, unless the true value equals the limit (margin, share).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import floor, inf, isfinite, isnan, log10, nan
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval, mean_interval, share_interval
from trackmark.bench.statistics.rules import (
    CLAIM_MARGIN,
    LIKELY,
    MIN_SCENES,
    MIN_UNITS,
    SHARE_LIMIT,
    corrected_level,
    decide,
    in_words,
    interval_or_none,
    missed_if_rare,
    too_few,
    units_for_small,
    units_needed,
)

Outcome = Literal["holds", "does not hold", "inconclusive", "by construction", "not testable here"]

NO_INTERVAL = Interval(nan, nan)

FLOOR_SHARE = 0.2
"""Share of scenes kept below which, with its interval, a tracker is at the floor."""

CEILING_SHARE = 0.8
"""Share of scenes kept above which, with its interval, a tracker is at the ceiling."""

MIN_KEPT_SCENES = 24
"""Minimum number of scenes that can show a floor or a ceiling."""


@dataclass(frozen=True)
class Verdict:
    """Verdict on a claim."""

    verdict: Outcome  # label that is printed and stored
    statistic: float = nan  # estimate, in `unit`; NaN if missing
    interval: Interval = NO_INTERVAL  # interval of the estimate, which determines the verdict
    n_units: int = 0  # number of units (`counted`) in the estimate
    reason: str = ""  # without a full stop
    estimate_name: str = ""  # name of the estimate or of the decisive part
    unit: str = ""
    counted: str = "scene"  # unit of repetition, in the singular

    @property
    def effect(self) -> str:
        """Estimate with interval, unit and number of scenes; empty without an estimate."""
        if isnan(self.statistic):
            return ""
        return f"{' '.join(filter(None, [self.estimate, self.unit]))}, {self.n_counted}"

    @property
    def n_counted(self) -> str:
        """Number of units: `24 scenes`."""
        return f"{self.n_units} {self.counted}{'s' * (self.n_units != 1)}"

    @property
    def estimate(self) -> str:
        """Estimate with name and interval, rounded to two digits of half the interval's width."""
        name = f"{self.estimate_name}: " if self.estimate_name else ""
        width = self.interval.high - self.interval.low
        if isnan(width):
            return f"{name}{self.statistic:.3g}"
        form = ".3g"
        if isfinite(width) and width > 0:
            form = f".{min(max(1 - floor(log10(width / 2)), 0), 9)}f"
        # A number that rounds to zero has no sign.
        low, value, high = (
            format(end, form) if float(format(end, form)) else format(0.0, form)
            for end in (self.interval.low, self.statistic, self.interval.high)
        )
        return f"{name}{value} [{low}, {high}]"


Judge = Callable[[int], Verdict]
"""Function of m that judges a part of a claim by its interval at level 1 - 0.05 / m."""


def inconclusive(reason: str) -> Verdict:
    """Return the verdict for a claim without an estimate."""
    return Verdict("inconclusive", reason=reason)


def order(differences: ArrayLike, margin: float = CLAIM_MARGIN, *, limit: float = inf) -> Verdict:
    """Judge "A is better than B".

    The claim holds if `rules.decide` returns better, and does not if it returns worse or
    equivalent. `differences`: A - B by scene, shape (n,), positive if A is better. For the other
    arguments see `rules.decide`.
    """
    values = _finite(differences)
    n = len(values)
    decision = decide(values, margin, limit=limit, unit="scenes")
    verdict: Outcome = "does not hold"
    if n < MIN_SCENES:
        verdict, reason = "inconclusive", too_few(n, MIN_SCENES, "scenes")
    elif decision.label == "better":
        verdict, reason = "holds", "interval above 0"
    elif decision.label == "worse":
        reason = "interval below 0"
    elif decision.label == "equivalent":
        reason = f"interval inside ±{margin:g}: too small to matter"
    else:
        verdict, reason = "inconclusive", decision.reason
    return Verdict(verdict, decision.mean, decision.interval or NO_INTERVAL, n, reason)


def no_worse(
    differences: ArrayLike,
    margin: float = CLAIM_MARGIN,
    comparisons: int = 1,
    *,
    limit: float = inf,
) -> Verdict:
    """Judge "A is as good as B, or better".

    The claim holds if the interval is above 0, or above -margin with enough scenes to show that a
    difference is small (`units_for_small`). It does not hold if the interval is below -margin. The
    level of the interval is 1 - 0.05 / `comparisons`. Other parameters: see `order`.
    """
    values = _finite(differences)
    n = len(values)
    mean, enough = _mean(values), units_for_small(margin, limit)
    interval = interval_or_none(values, comparisons, -limit, limit) or NO_INTERVAL
    verdict: Outcome = "inconclusive"
    if n < MIN_SCENES:
        reason = too_few(n, MIN_SCENES, "scenes")
    elif interval.high < -margin:
        verdict, reason = "does not hold", f"worse by more than {margin:g}"
    elif interval.low <= -margin:
        likely = mean_interval(values + margin, LIKELY)
        shifted = Interval(interval.low + margin, interval.high + margin)
        needed = units_needed(mean + margin, shifted, likely, n, 0.0)
        if needed and mean > -margin:  # the claim can hold only with enough scenes
            needed = Interval(*(max(number, enough) for number in needed))
        reason = _contains(-margin, needed)
    elif n >= enough or interval.low > 0:
        verdict, reason = "holds", f"not worse by more than {margin:g}"
    else:
        where = f"inside ±{margin:g}" if interval.inside(margin) else f"above {-margin:g}"
        reason = f"{where}; {missed_if_rare(n, 'scenes')}"
    return Verdict(verdict, mean, interval, n, reason)


def share(succeeded: ArrayLike, limit: float = SHARE_LIMIT) -> Verdict:
    """Judge whether the share of successful scenes is above a limit in [0, 1].

    The claim holds if the interval of the share (`share_interval`) is above the limit, and does not
    if it is below. `succeeded`: 1 for each scene that succeeds, else 0, shape (n,).
    """
    successes = _finite(succeeded)
    n, value, interval, likely = len(successes), _mean(successes), NO_INTERVAL, NO_INTERVAL
    if n >= MIN_UNITS:
        interval = share_interval(float(successes.sum()), n)
        likely = share_interval(float(successes.sum()), n, LIKELY)
    verdict: Outcome = "inconclusive"
    if n < MIN_SCENES:
        reason = too_few(n, MIN_SCENES, "scenes")
    elif interval.low > limit:
        verdict, reason = "holds", f"interval above {limit:g}"
    elif interval.high < limit:
        verdict, reason = "does not hold", f"interval below {limit:g}"
    else:
        shifted, shifted_likely = (
            Interval(*(end - limit for end in ends)) for ends in (interval, likely)
        )
        needed = units_needed(value - limit, shifted, shifted_likely, n, 0.0)
        reason = _contains(limit, needed)
    return Verdict(verdict, value, interval, n, reason)


def kept_interval(kept_shares: ArrayLike, *, sets: bool = False) -> Interval:
    """Return the interval of the share of scenes, or of members of sets, that a tracker keeps.

    `kept_shares`: 1 or 0 for a scene, share of kept members of a set in [0, 1], shape (n,).
    The interval of scenes is that of `share`; the interval of sets is that of a mean. It is missing
    (NaN) for fewer than `MIN_KEPT_SCENES` units.
    """
    shares = _finite(kept_shares)
    if len(shares) < MIN_KEPT_SCENES:
        return NO_INTERVAL
    if not sets:
        return share_interval(float(shares.sum()), len(shares))
    low, high = mean_interval(shares)
    return Interval(max(low, 0.0), min(high, 1.0))


def at_floor(kept_intervals: Iterable[Interval]) -> bool:
    """Return whether all trackers, by their intervals of `kept_interval`, lose the target."""
    return all(interval.high < FLOOR_SHARE for interval in kept_intervals)


def at_ceiling(kept_intervals: Iterable[Interval]) -> bool:
    """Return whether all trackers, by their intervals of `kept_interval`, keep the target."""
    return all(interval.low > CEILING_SHARE for interval in kept_intervals)


def conjunction(judges: Mapping[str, Judge]) -> Verdict:
    """Judge a claim with k parts, all of which must hold.

    The claim holds if all parts hold at 95 %. This needs no correction, because a false claim has
    at least one false part. It does not hold if one part does not hold by its interval at level 1 -
    0.05 / k, because each part can fail by chance. The result contains the numbers of the first
    failing part, else of the first inconclusive part, else of the first part.
    """
    k = len(judges)
    verdicts = {name: judge(1) for name, judge in judges.items()}
    for name, verdict in verdicts.items():
        if verdict.verdict == "does not hold":
            verdicts[name] = judges[name](k)
    failing = [name for name, part in verdicts.items() if part.verdict == "does not hold"]
    open_parts = [name for name, part in verdicts.items() if part.verdict != "holds"]
    name = (failing or open_parts or [*verdicts])[0]
    decides = replace(verdicts[name], estimate_name=name)
    if failing:
        level = f"interval at {100 * corrected_level(k):.3g} %"
        return replace(decides, reason=f"part {name}: {decides.reason}; {level}")
    if open_parts:
        return replace(decides, verdict="inconclusive", reason=f"part {name}: {decides.reason}")
    return replace(decides, reason=f"all {k} parts hold")


def _contains(limit: float, needed: Interval | None) -> str:
    """Return the reason of an undecided interval, with the range of scenes needed if known."""
    scenes = f"; {in_words(needed, 'scenes')}" if needed else ""
    return f"interval contains {limit:g}{scenes}"


def _mean(values: NDArray[Any]) -> float:
    return float(values.mean()) if len(values) else nan


def _finite(values: ArrayLike) -> NDArray[np.float64]:
    numbers = np.asarray(values, np.float64)
    if numbers.ndim != 1 or not np.isfinite(numbers).all():
        raise ValueError("Expected: one finite value per scene.")
    return numbers
