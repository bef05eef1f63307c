"""Answer of a comparison in one sentence, for pages, terminal, Markdown and JSON."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from math import isfinite
from typing import NamedTuple

from trackmark.bench.analysis.comparison import Comparison, Standing
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.statistics.units import StatisticalUnits

_MAX_NAMES = 3
"""Maximum number of trackers that a sentence names; more are counted."""

_NUMBERS = ("No", "One", "Two", "Three", "Four", "Five")

_RELATIONS = {
    "better": "it is better than {}",
    "worse": "it is worse than {}",
    "inconclusive": "it is not clearly better than {}",
    "equivalent": "it is equivalent to {}",
}
"""Relation of the first tracker to others, by the decision on the pair."""


class Answer(NamedTuple):
    """Answer in one sentence, and details: second-best tracker, wins, too few units."""

    heading: str
    details: tuple[str, ...] = ()


def answer_of(comparison: Comparison) -> Answer:
    """Return the answer of a comparison, on its main tracker against every other tracker.

    With fewer than `MIN_UNITS` units no tracker is called better.
    """
    measure, units = comparison.measure, comparison.units
    standings = [_in_printed_unit(standing, measure.scale) for standing in comparison.standings]
    ranked = sorted(standings, key=lambda standing: -comparison.sign * standing.mean)
    first = next(
        (standing for standing in ranked if standing.tracker == comparison.main), ranked[0]
    )
    other_standings = [standing for standing in ranked if standing is not first]
    digits = _digits(ranked, max(0, measure.decimals - 1))
    heading = _heading(comparison, first, other_standings, digits)
    details = [*_runner_up(comparison, first, other_standings, digits), *_wins(comparison)]
    if comparison.published:
        details.insert(0, _rank(ranked.index(first) + 1, len(ranked), first.tracker))
    if len(units) < MIN_UNITS:
        details.append(_limit(units))
    if comparison.undefined:
        details.append(undefined_note(comparison))
    if comparison.left_out:
        details.append(f"{_names(comparison.left_out)} left out: all runs failed.")
    return Answer(heading, tuple(details))


def _rank(rank: int, n: int, tracker: str) -> str:
    """Return the place of a tracker among all, those with published scores included."""
    return f"By its mean, {tracker} has rank {rank} of {n}."


def undefined_note(comparison: Comparison) -> str:
    """Return a sentence on the sequences that are left out because no run has a score."""
    names = comparison.undefined
    return f"{_names(names)} left out: {comparison.measure.title} is undefined for all trackers."


def _in_printed_unit(standing: Standing, scale: float) -> Standing:
    interval = standing.interval and (standing.interval[0] * scale, standing.interval[1] * scale)
    return replace(standing, mean=standing.mean * scale, interval=interval)


def _heading(
    comparison: Comparison, first: Standing, other_standings: Sequence[Standing], digits: int
) -> str:
    title, units = comparison.measure.title, comparison.units
    value = _value(comparison, first, digits)
    few = len(units) < MIN_UNITS
    where = f"{'these' if few else 'all'} {len(units)} {units.plural}"
    where = f"this {units.unit_kind}" if len(units) == 1 else where
    if not other_standings:
        return f"{first.tracker} has a {title} of {value} on {where}."
    best = "highest" if comparison.sign > 0 else "lowest"
    winners = []
    if comparison.sign * (other_standings[0].mean - first.mean) > _tie(digits):
        # The user named a main tracker that is not the best one.
        sentence = f"{first.tracker} has a {title} of {value} on {where}"
        winners = [
            standing
            for standing in other_standings
            if abs(standing.mean - other_standings[0].mean) <= _tie(digits)
        ]
    elif few:
        ties = [
            standing.tracker
            for standing in other_standings
            if abs(standing.mean - first.mean) <= _tie(digits)
        ]
        verb = "have" if ties else "has"
        names = _names([first.tracker, *ties])
        return f"{names} {verb} the {best} {title} on {where}: {value}."
    else:
        sentence = f"{first.tracker} has the {best} {title}, {value}"
    groups: dict[str, list[str]] = {}
    for standing in other_standings:
        label, _ = comparison.main_answers.get(standing.tracker, ("", ""))
        groups.setdefault(label, []).append(standing.tracker)
    if groups.keys() == {"better"}:
        names = _names(groups["better"], _counted(len(other_standings), len(other_standings)))
        return f"{first.tracker} is better than {names}: {title} {value}."
    clauses = [
        words.format(_names(groups[label], _counted(len(groups[label]), len(other_standings))))
        for label, words in _RELATIONS.items()
        if label in groups and not few
    ]
    if winners:
        verb, highest = (
            "has" if len(winners) == 1 else "have",
            f"{other_standings[0].mean:.{digits}f}",
        )
        names = _names([standing.tracker for standing in winners])
        clauses.append(f"{names} {verb} the {best}, {highest}{comparison.unit_suffix}")
    return f"{'; '.join([sentence, *clauses])}."


def _counted(n: int, n_others: int) -> str:
    """Return the number of trackers, of all others, that have one relation to the first."""
    return f"{n} of the other {n_others} trackers" if n < n_others else f"the other {n} trackers"


def _runner_up(
    comparison: Comparison, first: Standing, other_standings: Sequence[Standing], digits: int
) -> list[str]:
    """Return a sentence on the second-best mean and its time; none after a tie."""
    sign = comparison.sign
    behind = [
        standing
        for standing in other_standings
        if sign * (first.mean - standing.mean) > _tie(digits)
    ]
    if not behind:
        return []
    second = behind[0]
    sentence = f"{second.tracker} follows with {second.mean:.{digits}f}{comparison.unit_suffix}"
    _, reason = comparison.main_answers.get(second.tracker, ("", ""))
    if reason and second.interval:
        sentence += f" ({reason.replace('interval', 'the interval of the difference', 1)})"
    if first.clock != second.clock:
        return [f"{sentence}."]
    if faster := _times_faster(first.ms_per_frame / second.ms_per_frame):
        sentence += f" and is {faster} faster"
    elif slower := _times_faster(second.ms_per_frame / first.ms_per_frame):
        sentence += f" and is {slower} slower"
    return [f"{sentence}."]


def _wins(comparison: Comparison) -> list[str]:
    """Return a sentence on the numbers of units on which one tracker leads."""
    units = comparison.units
    if len(comparison.scores) < 2 or len(units) < 2:
        return []
    means = [[run.mean() for run in runs] for runs in comparison.scores.values()]
    by_unit = comparison.sign * units.means(means)
    leads = by_unit == by_unit.max(axis=0)
    counts = (leads & (leads.sum(axis=0) == 1)).sum(axis=1).tolist()
    wins = zip(comparison.scores, counts, strict=True)
    winners = sorted((win for win in wins if win[1]), key=lambda win: -win[1])
    if not winners:
        return []
    (name, count), *rest = winners[:_MAX_NAMES]
    clauses = [f"{name} leads on {count} of {len(units)} {units.plural}"]
    clauses += [f"{name} on {count}" for name, count in rest]
    if n_others := sum(count for _, count in winners[_MAX_NAMES:]):
        clauses.append(f"other trackers on {n_others}")
    return [f"{', '.join(clauses)}."]


def _limit(units: StatisticalUnits) -> str:
    n = len(units)
    words = f"{_NUMBERS[n]} {units.plural} are" if n != 1 else f"One {units.unit_kind} is"
    return f"{words} too few to generalise ({MIN_UNITS} needed{units.remedy})."


def _value(comparison: Comparison, standing: Standing, digits: int) -> str:
    value = f"{standing.mean:.{digits}f}{comparison.unit_suffix}"
    if standing.interval is not None:
        value += " [{:.{d}f}, {:.{d}f}]".format(*standing.interval, d=digits)
    return value


def _digits(ranked: Sequence[Standing], decimals: int) -> int:
    """Return the number of decimals: one more if the two best means differ only in that digit."""
    if len(ranked) < 2:
        return decimals
    first, second = ranked[0].mean, ranked[1].mean
    equal = f"{first:.{decimals}f}" == f"{second:.{decimals}f}"
    return decimals + (equal and abs(first - second) > _tie(decimals + 1))


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
    """Return how many times faster in words, with one digit; empty below twice as fast.

    >>> _times_faster(1.9), _times_faster(2.6), _times_faster(337)
    ('', 'about 3 times', 'about 300 times')
    """
    if not isfinite(ratio) or ratio < 2:
        return ""
    return f"about {float(f'{ratio:.1g}'):.0f} times"
