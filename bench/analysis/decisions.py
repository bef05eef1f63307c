"""Answer of a comparison in one sentence, for pages, terminal, Markdown and JSON."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from trackmark.bench.analysis.comparison import Comparison, Standing
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.statistics.units import StatisticalUnits

_MAX_NAMES = 3
"""Maximum number of trackers that a sentence names; more are counted."""

_NO_WINNER = "No clear winner"

_NUMBERS = ("No", "One", "Two", "Three", "Four", "Five")

_RELATIONS = {
    "better": "better than {}",
    "worse": "worse than {}",
    "equivalent": "equivalent to {}",
    "inconclusive": "not clearly different from {}",
}
"""Relation of the main tracker to others, by the decision on the pair."""


class Answer(NamedTuple):
    """Answer in one sentence, and further sentences: counts, relations, too few units."""

    heading: str
    details: tuple[str, ...] = ()


def answer_of(comparison: Comparison) -> Answer:
    """Return the answer of a comparison: the better tracker, or the best ones without a winner.

    It is about the tracker `against` if there is one. With fewer than `MIN_UNITS` units no tracker
    is called better.
    """
    ranked = comparison.ranked
    main = next((entry for entry in ranked if entry.tracker == comparison.main), ranked[0])
    heading, *details = _sentences(comparison, ranked, main)
    if len(comparison.units) < MIN_UNITS:
        details = [_limit(comparison.units)]
    if comparison.undefined:
        details.append(undefined_note(comparison))
    if comparison.left_out:
        details.append(f"{_names(comparison.left_out)} left out: all runs failed.")
    return Answer(heading, tuple(details))


def _sentences(comparison: Comparison, ranked: Sequence[Standing], main: Standing) -> list[str]:
    """Return the heading and, with enough units, a second sentence."""
    title, units = comparison.measure.title, comparison.units
    few, other_trackers = len(units) < MIN_UNITS, [entry for entry in ranked if entry is not main]
    where = f"{'these ' * few}{len(units)} {units.plural}"
    where = f"this {units.unit_kind}" if len(units) == 1 else where
    scope, values = f"{title[:1].upper()}{title[1:]} on {where}", _values(comparison, ranked)
    if not other_trackers:
        return [f"{main.tracker} has a {title} of {values[main.tracker]} on {where}."]
    if comparison.published:
        rank = f"{main.tracker} has rank {ranked.index(main) + 1} of {len(ranked)}"
        heading = f"{rank} by {title} on {where}: {values[main.tracker]}."
        if few or not comparison.pairs:
            return [heading]
        return [
            heading,
            f"It is {_relations(_groups(comparison, other_trackers), len(other_trackers))}.",
        ]
    if few or not comparison.pairs:
        return [f"{scope}: {_listed(ranked, main, values)}."]
    groups = _groups(comparison, other_trackers)
    beaten = groups.get("better", [])
    if comparison.against or "inconclusive" not in groups or other_trackers[0] in beaten:
        compared = f"{main.tracker} is {_relations(groups, len(other_trackers))}"
        return [f"{compared}: {_against(comparison, groups, main, values)}.", f"{scope}."]
    leading = [entry for entry in ranked if entry not in beaten]
    if beaten:
        scope += f"; {main.tracker} is {_relations({'better': beaten}, len(other_trackers))}"
    return [f"{_NO_WINNER}: {_listed(leading, main, values)}.", f"{scope}."]


def no_winner_reason(comparison: Comparison) -> str:
    """Return which trackers are not clearly different from the best one, without a full stop.

    The text is empty if the answer is not that there is no clear winner.
    """
    if not answer_of(comparison).heading.startswith(f"{_NO_WINNER}: "):
        return ""
    other_trackers = [entry for entry in comparison.standings if entry.tracker != comparison.main]
    groups = _groups(comparison, other_trackers)
    relation = _relations({"inconclusive": groups["inconclusive"]}, len(other_trackers))
    return f"{comparison.main} is {relation}"


def _groups(
    comparison: Comparison, other_trackers: Sequence[Standing]
) -> dict[str, list[Standing]]:
    """Return the other trackers by the decision whether the main one is better."""
    answers = comparison.main_answers
    grouped = {
        label: [entry for entry in other_trackers if answers[entry.tracker][0] == label]
        for label in _RELATIONS
    }
    return {label: group for label, group in grouped.items() if group}


def _relations(groups: Mapping[str, Sequence[Standing]], n_others: int) -> str:
    """Return in words how the main tracker compares with others; long groups are counted."""
    clauses = []
    for label, group in groups.items():
        names = _names([entry.tracker for entry in group], _counted(len(group), n_others))
        clauses.append(_RELATIONS[label].format(names))
    return _joined(clauses)


def _against(
    comparison: Comparison,
    groups: Mapping[str, Sequence[Standing]],
    main: Standing,
    values: Mapping[str, str],
) -> str:
    """Return the value of the main tracker and those of the others in the order of their names."""
    other_values = [values[entry.tracker] for group in groups.values() for entry in group]
    if len(other_values) <= _MAX_NAMES:
        return f"{values[main.tracker]} against {_joined(other_values)}"
    bound = f" against {other_values[0]} or {'less' if comparison.measure.sign > 0 else 'more'}"
    return values[main.tracker] + bound * (groups.keys() == {"better"})


def _listed(ranked: Sequence[Standing], main: Standing, values: Mapping[str, str]) -> str:
    """Return names and values of the best trackers and of the main one."""
    named = list(ranked[:_MAX_NAMES])
    if main not in named:
        named[-1] = main
    text = ", ".join(f"{entry.tracker} {values[entry.tracker]}" for entry in named)
    n_more = len(ranked) - len(named)
    return f"{text} and {n_more} more" if n_more else text


def undefined_note(comparison: Comparison) -> str:
    """Return a sentence on the sequences that are left out because no run has a score."""
    names = comparison.undefined
    return f"{_names(names)} left out: {comparison.measure.title} is undefined for all trackers."


def _counted(n: int, n_others: int) -> str:
    """Return the number of trackers, of all others, that have one relation to the first."""
    return f"{n} of the other {n_others} trackers" if n < n_others else f"the other {n} trackers"


def _limit(units: StatisticalUnits) -> str:
    n = len(units)
    words = f"{_NUMBERS[n]} {units.plural} are" if n != 1 else f"One {units.unit_kind} is"
    return f"{words} too few to generalise ({MIN_UNITS} needed{units.remedy})."


def _values(comparison: Comparison, ranked: Sequence[Standing]) -> dict[str, str]:
    """Return the printed means with one decimal less than in tables.

    If the two best means are equal then but not in tables, all means have the decimals of tables.
    """
    decimals = comparison.measure.decimals
    short = _printed_means(comparison, ranked, max(0, decimals - 1))
    long = _printed_means(comparison, ranked, decimals)
    if len(ranked) > 1:
        first, second = ranked[0].tracker, ranked[1].tracker
        if short[first] == short[second] and long[first] != long[second]:
            return long
    return short


def _printed_means(
    comparison: Comparison, ranked: Sequence[Standing], decimals: int
) -> dict[str, str]:
    scale, unit = comparison.measure.scale, comparison.unit_suffix
    return {entry.tracker: f"{entry.mean * scale:.{decimals}f}{unit}" for entry in ranked}


def _names(names: Collection[str], if_many: str = "") -> str:
    """Return names joined to a phrase, or `if_many` if there are too many."""
    listed = list(names)
    if len(listed) > _MAX_NAMES:
        return if_many or f"{', '.join(listed[:_MAX_NAMES])} and {len(listed) - _MAX_NAMES} more"
    return _joined(listed)


def _joined(clauses: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(clauses[:-1]), clauses[-1]]))
