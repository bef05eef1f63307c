"""Answer of a comparison in one sentence, for pages, terminal, Markdown and JSON."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple

from trackmark.bench.statistics.rules import MIN_UNITS

_MAX_NAMES = 3
"""Maximum number of trackers that a sentence names; more are counted."""

_NUMBERS = ("No", "One", "Two", "Three", "Four", "Five")


class RankedTracker(NamedTuple):
    """Tracker of a comparison and its mean score, in the unit in which the mean is printed."""

    name: str
    mean: float
    interval: tuple[float, float] | None = (
        None  # interval of the mean; None below `MIN_UNITS` units
    )
    wins: int = 0  # number of units on which the tracker is better than every other tracker
    milliseconds: float = nan  # per frame
    answer: str = ""  # decision on the main tracker against this one, such as `better`
    reason: str = ""  # reason of an inconclusive answer
    clock: str = ""  # see `Standing`; times are compared only if the clocks are equal


@dataclass(frozen=True)
class Measured:
    """Score and units of an answer, in words."""

    n_units: int
    unit: str = "sequence"
    plural: str = "sequences"
    title: str = "mean overlap"
    suffix: str = ""  # unit after a number, such as ` px`
    decimals: int = 2
    higher: bool = True  # True if higher scores are better
    remedy: str = ""  # advice for too few units, see `StatisticalUnits.remedy`


class Answer(NamedTuple):
    """Answer in one sentence, and details: second-best tracker, wins, too few units."""

    heading: str
    details: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """All sentences."""
        return " ".join((self.heading, *self.details))


def answer(
    trackers: Sequence[RankedTracker],
    measured: Measured,
    main: str = "",
    left_out: Collection[str] = (),
) -> Answer:
    """Return the answer of a comparison.

    `main`: tracker that is compared with every other one; by default, that with the best mean.
    `left_out`: trackers without a score, as all of their runs failed. With fewer than `MIN_UNITS`
    units no tracker is called better.
    """
    if not trackers:
        return Answer("There is no answer: all runs failed.")
    ranked = sorted(trackers, key=lambda entry: -entry.mean if measured.higher else entry.mean)
    first = next((entry for entry in ranked if entry.name == main), ranked[0])
    others = [entry for entry in ranked if entry is not first]
    digits = _digits(ranked, measured)
    heading = _heading(first, others, measured, digits)
    details = [*_runner_up(first, others, measured, digits), *_wins(ranked, measured)]
    if measured.n_units < MIN_UNITS:
        details.append(_limit(measured))
    if left_out:
        details.append(f"{_names(left_out)} left out: all runs failed.")
    return Answer(heading, tuple(details))


def _heading(
    first: RankedTracker, others: Sequence[RankedTracker], measured: Measured, digits: int
) -> str:
    value = _value(first, measured, digits)
    few = measured.n_units < MIN_UNITS
    units = measured.plural if measured.n_units != 1 else measured.unit
    where = f"{'these' if few else 'all'} {measured.n_units} {units}"
    where = f"this {units}" if measured.n_units == 1 else where
    if not others:
        return f"{first.name} has a {measured.title} of {value} on {where}."
    best = "highest" if measured.higher else "lowest"
    sign = 1 if measured.higher else -1
    if sign * (others[0].mean - first.mean) > _tie(digits):  # a main tracker that the user named
        text = f"{first.name} has a {measured.title} of {value} on {where}"
    elif few:
        ties = [entry.name for entry in others if abs(entry.mean - first.mean) <= _tie(digits)]
        verb = "have" if ties else "has"
        names = _names([first.name, *ties])
        return f"{names} {verb} the {best} {measured.title} on {where}: {value}."
    else:
        text = f"{first.name} has the {best} {measured.title}, {value}"
    groups: dict[str, list[str]] = {}
    for entry in others:
        groups.setdefault(entry.answer, []).append(entry.name)
    if groups.keys() == {"better"}:
        whom = _names(groups["better"], f"the other {len(others)} trackers")
        return f"{first.name} is better than {whom}: {measured.title} {value}."
    relations = {
        "better": "it is better than {}",
        "worse": "it is worse than {}",
        "inconclusive": "it is not clearly better than {}",
        "equivalent": "it is equivalent to {}",
    }
    parts = [
        words.format(_names(groups[label], f"{len(groups[label])} of {len(others)} trackers"))
        for label, words in relations.items()
        if label in groups and not few
    ]
    return f"{'; '.join([text, *parts])}."


def _runner_up(
    first: RankedTracker, others: Sequence[RankedTracker], measured: Measured, digits: int
) -> list[str]:
    """Return a sentence on the second-best mean and its time; none after a tie."""
    sign = 1 if measured.higher else -1
    behind = [entry for entry in others if sign * (first.mean - entry.mean) > _tie(digits)]
    if not behind:
        return []
    second = behind[0]
    text = f"{second.name} follows with {second.mean:.{digits}f}{measured.suffix}"
    if second.reason and second.interval:
        reason = second.reason.replace("interval", "the interval of the difference", 1)
        text += f" ({reason})"
    if first.clock != second.clock:
        return [f"{text}."]
    if faster := _times_faster(first.milliseconds / second.milliseconds):
        text += f" and is {faster} faster"
    elif slower := _times_faster(second.milliseconds / first.milliseconds):
        text += f" and is {slower} slower"
    return [f"{text}."]


def _wins(ranked: Sequence[RankedTracker], measured: Measured) -> list[str]:
    """Return a sentence on the numbers of units on which one tracker leads."""
    winners = sorted((entry for entry in ranked if entry.wins), key=lambda entry: -entry.wins)
    if len(ranked) < 2 or measured.n_units < 2 or not winners:
        return []
    first, *rest = winners[:_MAX_NAMES]
    parts = [f"{first.name} leads on {first.wins} of {measured.n_units} {measured.plural}"]
    parts += [f"{entry.name} on {entry.wins}" for entry in rest]
    others = sum(entry.wins for entry in winners[_MAX_NAMES:])
    return [f"{', '.join([*parts, *([f'other trackers on {others}'] if others else [])])}."]


def _limit(measured: Measured) -> str:
    n = measured.n_units
    units = f"{_NUMBERS[n]} {measured.plural} are" if n != 1 else f"One {measured.unit} is"
    return f"{units} too few to generalise ({MIN_UNITS} needed{measured.remedy})."


def _value(entry: RankedTracker, measured: Measured, digits: int) -> str:
    text = f"{entry.mean:.{digits}f}{measured.suffix}"
    if entry.interval is not None:
        text += " [{:.{d}f}, {:.{d}f}]".format(*entry.interval, d=digits)
    return text


def _digits(ranked: Sequence[RankedTracker], measured: Measured) -> int:
    """Return the number of decimals: one more if the two best means differ only in that digit."""
    digits = measured.decimals
    if len(ranked) < 2:
        return digits
    first, second = ranked[0].mean, ranked[1].mean
    equal = f"{first:.{digits}f}" == f"{second:.{digits}f}"
    return digits + (equal and abs(first - second) > _tie(digits + 1))


def _tie(digits: int) -> float:
    """Return the largest difference of means that are printed as equal."""
    return float(0.5 * 10.0 ** -(digits + 1))


def _names(names: Collection[str], if_many: str = "") -> str:
    """Return names joined to a phrase, or `if_many` if there are too many."""
    listed = list(names)
    if len(listed) > _MAX_NAMES:
        return if_many or f"{', '.join(listed[:_MAX_NAMES])} and {len(listed) - _MAX_NAMES} more"
    return " and ".join(filter(None, [", ".join(listed[:-1]), listed[-1]]))


def _times_faster(ratio: float) -> str:
    """Return how many times faster in words; times under load do not allow a number."""
    if not isfinite(ratio) or ratio < 2:
        return ""
    scale = ("several times", "tens of times", "hundreds of times", "thousands of times")
    return scale[sum(ratio >= limit for limit in (10, 100, 1000))]
