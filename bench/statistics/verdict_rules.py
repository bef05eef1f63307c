"""Rules that judge claims: five kinds of test, as pure functions of one value per scene.

    order(differences)                  "A is better than B", differences A - B
    no_worse(differences)               "A is as good as B, or better"
    share(successes, trials, limit)     "in most scenes it is so", counts per scene
    number(values, published)           a published number next to ours; never judged
    time(longer, shorter, factor)       "A takes longer than B by a factor", times of pairs
    conjunction(parts)                  a claim with several parts, all of which must hold

Every verdict is read off its printed interval (`rules`). Differences and margins have the same
unit. With `comparisons` = m the interval is at level 1 - 0.05 / m. Every true value other than the
limit itself (margin, share, factor) is decided if there are enough scenes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import exp, floor, inf, isfinite, isnan, log, log10, nan
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.intervals import Interval, share_interval
from trackmark.bench.statistics.rules import (
    CLAIM_MARGIN,
    MIN_SCENES,
    MIN_UNITS,
    MIN_UNITS_FOR_SMALL,
    SHARE_LIMIT,
    about,
    corrected_level,
    decide,
    interval_or_none,
    only,
    units_needed,
)

Outcome = Literal["holds", "does not hold", "inconclusive", "not testable"]

NOWHERE = Interval(nan, nan)


@dataclass(frozen=True)
class Verdict:
    """Verdict on a claim."""

    verdict: Outcome  # label that is printed and stored
    statistic: float = nan  # estimate, in `unit`; NaN if there is none
    interval: Interval = NOWHERE  # of the estimate, from which the verdict was read
    cells: int = 0  # number of units (`counted`) on which the estimate rests
    reason: str = ""  # without a full stop
    of: str = ""  # name of the estimate; of a claim with parts, of the part that decides
    unit: str = ""
    counted: str = "scene"  # unit of repetition, in the singular

    @property
    def effect(self) -> str:
        """Estimate with interval, unit and number of scenes; empty if there is no estimate."""
        if isnan(self.statistic):
            return ""
        estimate = f"{self.of}: {self._numbers}" if self.of else self._numbers
        counted = self.counted if self.cells == 1 else plural(self.counted)
        return f"{' '.join(filter(None, [estimate, self.unit]))}, {self.cells} {counted}"

    @property
    def _numbers(self) -> str:
        """Estimate and interval, to two digits of half of the interval's width."""
        width = self.interval.high - self.interval.low
        if isnan(width):
            return f"{self.statistic:.3g}"
        form = ".3g"
        if isfinite(width) and width > 0:
            form = f".{min(max(1 - floor(log10(width / 2)), 0), 9)}f"
        # A number that rounds to zero has no sign.
        low, value, high = (
            format(end, form) if float(format(end, form)) else format(0.0, form)
            for end in (self.interval.low, self.statistic, self.interval.high)
        )
        return f"{value} [{low}, {high}]"


Judge = Callable[[int], Verdict]
"""Judges a part of a claim with its interval at level 1 - 0.05 / m, for the argument m."""


def inconclusive(reason: str) -> Verdict:
    """Return the verdict on a claim without an estimate."""
    return Verdict("inconclusive", reason=reason)


def plural(counted: str) -> str:
    """Return the plural of a unit of repetition."""
    return f"{counted}s" if not counted.endswith("x") else f"{counted}es"


def order(
    differences: ArrayLike,
    margin: float = CLAIM_MARGIN,
    comparisons: int = 1,
    *,
    limit: float = inf,
    counted: str = "scene",
) -> Verdict:
    """Judge "A is better than B".

    Holds if the answer of `rules.decide` is better; does not hold if it is worse or equivalent.
    `differences`: A - B by scene, shape (n,), positive if A is better. `counted`: name of a unit in
    the reason, in the singular. The other arguments are those of `rules.decide`.
    """
    values = _finite(differences)
    n, units = len(values), plural(counted)
    answer = decide(values, margin, comparisons, limit=limit, unit=units)
    verdict: Outcome = "does not hold"
    if n < MIN_SCENES:
        verdict, reason = "inconclusive", only(n, MIN_SCENES, units)
    elif answer.label == "better":
        verdict, reason = "holds", "interval above 0"
    elif answer.label == "worse":
        reason = "interval below 0"
    elif answer.label == "equivalent":
        reason = f"too small to matter (±{margin:g})"
    else:
        verdict, reason = "inconclusive", answer.reason
    return Verdict(verdict, answer.mean, answer.interval or NOWHERE, n, reason, counted=counted)


def no_worse(
    differences: ArrayLike,
    margin: float = CLAIM_MARGIN,
    comparisons: int = 1,
    *,
    limit: float = inf,
    counted: str = "scene",
) -> Verdict:
    """Judge "A is as good as B, or better".

    Holds if the interval is above -margin and there are 30 scenes or it is above 0. Does not
    hold if the interval is below -margin. Parameters: see `order`.
    """
    values = _finite(differences)
    n, units = len(values), plural(counted)
    mean = _mean(values)
    interval = interval_or_none(values, comparisons, -limit, limit) or NOWHERE
    verdict: Outcome = "inconclusive"
    if n < MIN_SCENES:
        reason = only(n, MIN_SCENES, units)
    elif interval.high < -margin:
        verdict, reason = "does not hold", f"worse by more than {margin:g}"
    elif interval.low <= -margin:
        shifted = Interval(interval.low + margin, interval.high + margin)
        needed = units_needed(mean + margin, shifted, n, 0.0)
        needed = max(needed, MIN_UNITS_FOR_SMALL) if mean > -margin else needed
        reason = f"interval contains the limit {-margin:g}; {about(needed)} {units} needed"
    elif n >= MIN_UNITS_FOR_SMALL or interval.low > 0:
        verdict, reason = "holds", f"not worse by more than {margin:g}"
    else:
        where = f"inside ±{margin:g}" if interval.inside(margin) else f"above {-margin:g}"
        reason = f"{where}, but {only(n, MIN_UNITS_FOR_SMALL, units)}"
    return Verdict(verdict, mean, interval, n, reason, counted=counted)


def share(
    successes: ArrayLike,
    trials: ArrayLike,
    limit: float = SHARE_LIMIT,
    comparisons: int = 1,
    *,
    counted: str = "scene",
) -> Verdict:
    """Judge whether something is so in more than a share of the scenes.

    A scene is a success if more than half of its trials are. Both counts have shape (n,); trials
    are above 0. Holds if the interval of the share of scenes (`share_interval`) is above the limit
    in [0, 1], does not hold if it is below. See `order` for the rest.
    """
    good, every = _finite(successes), _finite(trials)
    if good.shape != every.shape or (every <= 0).any() or (good < 0).any() or (good > every).any():
        raise ValueError("successes must be 0 to trials in each scene, and trials above 0.")
    n = len(good)
    value, interval = _mean(2 * good > every), NOWHERE
    if n >= MIN_UNITS:
        interval = share_interval(good, every, corrected_level(comparisons))
    return _beyond_limit(value, interval, n, limit, counted)


def time(
    longer: ArrayLike,
    shorter: ArrayLike,
    factor: float = 1.0,
    comparisons: int = 1,
    *,
    counted: str = "pair",
) -> Verdict:
    """Judge whether one thing takes longer than another by more than a factor above 0.

    Holds if the interval of the geometric mean of the ratios is above the factor, does not hold if
    it is below. Times have shape (n,), are above 0 and in the same unit; those of a pair were
    measured one after the other. See `order` for the rest.
    """
    over, under = _finite(longer), _finite(shorter)
    if over.shape != under.shape or (over <= 0).any() or (under <= 0).any():
        raise ValueError("a ratio needs pairs of times above 0.")
    ratios = np.log(over / under)
    low, high = interval_or_none(ratios, comparisons) or NOWHERE
    value, interval = exp(_mean(ratios)), Interval(exp(low), exp(high))
    verdict = _beyond_limit(value, interval, len(ratios), factor, counted, MIN_UNITS, log)
    return replace(verdict, unit="times as long")


def number(
    values: ArrayLike,
    published: float | None = None,
    *,
    most: float | None = None,
    counted: str = "scene",
) -> Verdict:
    """Print a published number next to ours; both come from different videos, so none is judged.

    `values`: ours, one per scene, shape (n,). `most`: largest value of a number that cannot be
    negative, for example 1 for a share.
    """
    numbers = _finite(values)
    least, greatest = (-inf, inf) if most is None else (0.0, most)
    interval = interval_or_none(numbers, 1, least, greatest) or NOWHERE
    paper = "" if published is None else f"the paper's number is {published:.3g}; "
    reason = f"{paper}number of other videos, printed and not judged"
    n = len(numbers)
    return Verdict("not testable", _mean(numbers), interval, n, reason, counted=counted)


def conjunction(parts: Mapping[str, Judge], comparisons: int = 1) -> Verdict:
    """Judge a claim with k parts, all of which must hold.

    Holds if all parts hold at 95 %: at least one part of a false claim is false. Does not hold if
    one part fails with its interval at level 1 - 0.05 / k, as each part can fail by chance.

    The numbers are those of the first part that fails, else of the first that is inconclusive,
    else of the first. With `comparisons` the claim itself is one of so many parts.
    """
    tests = comparisons * len(parts)
    verdicts = {name: judge(1) for name, judge in parts.items()}
    for name, verdict in verdicts.items():
        if verdict.verdict == "does not hold" and tests > 1:
            verdicts[name] = parts[name](tests)
    failing = [name for name, part in verdicts.items() if part.verdict == "does not hold"]
    open_parts = [name for name, part in verdicts.items() if part.verdict != "holds"]
    name = (failing or open_parts or [*verdicts])[0]
    decides = replace(verdicts[name], of=name)
    if failing:
        level = f"; interval at {100 * corrected_level(tests):.3g} %" if tests > 1 else ""
        return replace(decides, reason=f"part {name}: {decides.reason}{level}")
    if open_parts:
        return replace(decides, verdict="inconclusive", reason=f"part {name}: {decides.reason}")
    return replace(decides, reason=f"all {len(parts)} parts hold")


def _beyond_limit(
    value: float,
    interval: Interval,
    n: int,
    limit: float,
    counted: str,
    least: int = MIN_SCENES,
    scale: Callable[[float], float] = float,
) -> Verdict:
    """Return whether an interval of `least` or more units is above or below a limit.

    `scale`: function that transforms a value into the unit of the averaged numbers.
    """
    verdict: Outcome = "inconclusive"
    if n < least:
        reason = only(n, least, plural(counted))
    elif interval.low > limit:
        verdict, reason = "holds", f"interval above {limit:g}"
    elif interval.high < limit:
        verdict, reason = "does not hold", f"interval below {limit:g}"
    else:
        middle = scale(limit)
        shifted = Interval(scale(interval.low) - middle, scale(interval.high) - middle)
        needed = about(units_needed(scale(value) - middle, shifted, n, 0.0))
        reason = f"interval contains the limit {limit:g}; {needed} {plural(counted)} needed"
    return Verdict(verdict, value, interval, n, reason, counted=counted)


def _mean(values: NDArray[Any]) -> float:
    return float(values.mean()) if len(values) else nan


def _finite(values: ArrayLike) -> NDArray[np.float64]:
    numbers = np.asarray(values, np.float64)
    if numbers.ndim != 1 or not np.isfinite(numbers).all():
        raise ValueError("a verdict needs one finite value per scene.")
    return numbers
