"""A verdict, and how those on the parts of a claim become one.

undecided(reason)                   nothing was run that tests it
check(passed, statistic, reason)    a stated criterion, without chance
chance(value, end, limit, cells)    how often a mean lies so far beyond a limit by chance
conjunction(verdicts, names)        a claim with several parts
enough_of(verdicts, names, limit, least)    one that is to be so of so many of its parts
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor, isfinite, isnan, log10, nan
from typing import Literal

from scipy.special import stdtr

from bench.statistics.intervals import Interval, t_quantile

__all__ = [
    "LEAST_CELLS",
    "LEVEL",
    "NOWHERE",
    "Outcome",
    "Verdict",
    "chance",
    "check",
    "conjunction",
    "enough_of",
    "undecided",
]

Outcome = Literal["reproduced", "holds", "does-not-hold", "undecided", "not-testable"]

# Set before anything was run, and the same for all papers.
LEAST_CELLS = 8
"""Below this many, intervals are wider than what is claimed."""

LEVEL = 0.025
"""How often a claim that is just true may be said not to hold: what lies beyond one end of a 95 %
interval."""

NOWHERE = Interval(nan, nan)


@dataclass(frozen=True)
class Verdict:
    """What was found of a claim.

    Attributes
    ----------
    verdict : {'reproduced', 'holds', 'does-not-hold', 'undecided', 'not-testable'}
        The outcome.
    statistic : float
        What was estimated, in `unit`; NaN where there is no number.
    interval : Interval
        95 % interval of it; NaN where there is none.
    cells : int
        Of what is `counted`, how many it rests on.
    reason : str
        Why, in one sentence for a reader.
    against : float
        One-sided p-value against the claim: how often one that is just true would fare as badly.
        NaN where chance plays no part, or nothing was tested.
    of, unit : str
        What was estimated, and in what; of a claim with parts, the one that decides.
    counted : str
        Unit of repetition, in the singular.
    tests : int
        One of how many it is, where it would fail by itself and doesn't surely among so many; else
        0.
    """

    verdict: Outcome
    statistic: float
    interval: Interval
    cells: int
    reason: str
    against: float = nan
    of: str = ""
    unit: str = ""
    counted: str = "cell"
    tests: int = 0

    @property
    def told(self) -> str:
        """Effect and reason."""
        return f"{self.effect}; {self.reason}" if self.effect else self.reason

    @property
    def effect(self) -> str:
        """Number, interval, unit and what they rest on, in words; empty where there is none."""
        if isnan(self.statistic):
            return ""
        told = f"{self.of}: {self._numbers}" if self.of else self._numbers
        rests = f"{self.cells} {self.counted}{'' if self.cells == 1 else 's'}"
        rests += f", one of {self.tests} tests" if self.tests else ""
        return f"{' '.join(filter(None, [told, self.unit]))}, {rests}"

    @property
    def _numbers(self) -> str:
        """To two digits of half of the interval's width."""
        width = self.interval.high - self.interval.low
        if isnan(width):
            return f"{self.statistic:.3g}"
        form = ".3g"
        if isfinite(width) and width > 0:
            form = f".{min(max(1 - floor(log10(width / 2)), 0), 9)}f"
        # What rounds to zero has no sign.
        low, value, high = (
            format(one, form) if float(format(one, form)) else format(0.0, form)
            for one in (self.interval.low, self.statistic, self.interval.high)
        )
        return f"{value} [{low}, {high}]"


def undecided(reason: str) -> Verdict:
    """A verdict on what was not run."""
    return Verdict("undecided", nan, NOWHERE, 0, reason)


def check(passed: bool, statistic: float, reason: str, cells: int = 1) -> Verdict:
    """Judge a stated criterion that leaves nothing to chance; needs no least number of cells."""
    return Verdict("holds" if passed else "does-not-hold", statistic, NOWHERE, cells, reason)


def chance(value: float, high: float, limit: float, cells: int) -> float:
    """How often a number is so low by chance where in truth it is at a limit: a one-sided p-value.

    The distance to the limit, told in that to the upper end of the 95 % interval, is taken to be
    distributed as Student's t: it is `LEVEL` where that end is the limit.

    Parameters
    ----------
    value, high, limit : float
        What was estimated, the upper end of its interval, and the limit; all three, and the lower
        end, with their signs turned for "so high".
    cells : int
        What it rests on, 2 or more.
    """
    if isnan(value) or isnan(high):
        return nan
    if value == high:
        return 0.5 if value == limit else float(value > limit)
    distance = (limit - value) / (high - value)
    return float(stdtr(cells - 1, -distance * t_quantile(cells - 1, 1 - 2 * LEVEL)))


def conjunction(
    verdicts: Sequence[Verdict], names: Sequence[str], reason: str | None = None
) -> Verdict:
    """Judge a claim with several parts, all of which must hold.

    That it holds needs no correction for their number: it is said only where each part by itself
    is surely so, and of a claim that is false one part at least is; that part is found to hold
    in no more than its own share of cases (an intersection-union test). That it does not hold is
    said where any part fails, and each has its own chance to do so falsely: the p-value of a part
    that fails must be at most `LEVEL` by the number of parts that were tested (Bonferroni's bound,
    whatever their dependence; Holm's steps would change only which other parts fail, too). A
    criterion without chance fails with certainty, and doesn't count.

    The numbers are those of the part that decides: of those that fail the one that does so most
    surely, else of those that are undecided, else of all, the one that is nearest to failing. A
    part without cells was not measured. The `reason` is by default what each part's verdict is.
    """
    parts = [replace(part, of=name) for part, name in zip(verdicts, names, strict=True)]
    tested = [part.against for part in parts if not isnan(part.against)]
    failing = [part for part in parts if part.verdict == "does-not-hold"]
    surely = [p for p in failing if isnan(p.against) or len(tested) * p.against <= LEVEL]
    left = [part for part in parts if part.verdict != "holds"]
    outcome: Outcome = "does-not-hold" if surely else "undecided" if left else "holds"
    certain = any(isnan(part.against) for part in surely)
    without = -1.0 if certain else 2.0  # where a part without a p-value comes
    decides = min(
        surely or left or parts,
        key=lambda part: (isnan(part.statistic), without if isnan(part.against) else part.against),
    )
    said = "; ".join(
        f"{part.verdict.replace('-', ' ') if part.cells else 'not measured'} for {part.of}"
        for part in parts
    )
    reason = f"{said}." if reason is None else reason
    tests = decides.tests
    if failing and not surely:
        reason += f" Among {len(tested)} tests none fails surely enough."
        tests = len(tested)
    against = nan if certain or not tested else min(1.0, len(tested) * min(tested))
    return replace(decides, verdict=outcome, reason=reason, against=against, tests=tests)


def enough_of(
    verdicts: Sequence[Verdict], names: Sequence[str], limit: float, least: int
) -> Verdict:
    """Judge whether a number lies above a limit in `least` or more of several parts.

    Holds where it is surely so of `least` parts, does not hold where it surely isn't in more than
    the rest. Each may be wrong in one of several ways, and is corrected for these: of n parts, n -
    `least` + 1 could make too many of those above, `least` too few (the partial conjunction of
    Benjamini and Heller, Biometrics 64, 2008, by Bonferroni's bound).

    Parameters
    ----------
    verdicts : sequence of Verdict
        What `share_at_least` or the like gave of each part, with this limit.
    names : sequence of str
        Of the parts.
    """
    parts = [replace(part, of=name) for part, name in zip(verdicts, names, strict=True)]
    parts.sort(key=lambda part: part.statistic, reverse=True)
    decides = parts[least - 1] if least <= len(parts) else parts[-1]
    above = ", ".join(part.of for part in parts if part.statistic >= limit)
    said = [part.verdict for part in parts]
    least_sure, most = said.count("holds"), len(parts) - said.count("does-not-hold")
    words = (
        f"{limit:g} or more: {above or 'none'}; by the intervals surely {least_sure} and at most "
        f"{most} of {len(parts)}"
    )
    fewest = min(part.cells for part in parts)
    if fewest < LEAST_CELLS:
        words += f"; {LEAST_CELLS} {decides.counted}s of each are needed"
        return replace(decides, verdict="undecided", reason=f"{words}.", against=nan)
    surely = sorted(chance(-p.statistic, -p.interval.low, -limit, p.cells) for p in parts)
    surely_not = sorted(part.against for part in parts)
    spare = len(parts) - least
    outcome: Outcome = "undecided"
    against = 0.0
    if spare >= 0:
        against = min(1.0, least * surely_not[spare])
        outcome = "holds" if (spare + 1) * surely[least - 1] <= LEVEL else outcome
    outcome = "does-not-hold" if against <= LEVEL else outcome
    return replace(decides, verdict=outcome, reason=f"{words}.", against=against)
