"""A comparison in words: captions, answers and the paragraph for a paper."""

from string import ascii_uppercase

from bench.comparing.comparison import Comparison
from bench.comparing.pairwise import Pair
from bench.statistics.intervals import Interval
from bench.statistics.rules import MIN_UNITS, corrected_level
from reports.tables import MISSING

__all__ = [
    "answer_text",
    "between",
    "called",
    "hold_together",
    "number",
    "paragraph",
    "same_boxes_text",
    "shown_pairs",
    "times",
    "too_few",
    "unit",
    "wins_text",
]

SENTENCE_PAIRS = 3
"""Pairs that get a sentence each; if there are more, one sentence per answer."""

SHOWN_PAIRS = 10
"""Pairs on a screen; if there are more, those with the best tracker are shown."""

LONGEST_PAIR = 44
"""Letters of a pair's names; longer ones are replaced by letters on a screen."""


def shown_pairs(comparison: Comparison) -> list[Pair]:
    """Return all pairs, or those with the best tracker if there are too many for a screen."""
    if len(comparison.pairs) <= SHOWN_PAIRS:
        return list(comparison.pairs)
    return comparison.main_pairs


def called(comparison: Comparison) -> dict[str, str]:
    """Return what a screen calls the trackers: their labels, or letters if these are long."""
    names = list(comparison.scores)
    longest = sorted(map(len, names))[-2:]
    if sum(longest) + 3 <= LONGEST_PAIR:
        return dict(zip(names, names, strict=True))
    firsts = ["", *ascii_uppercase]
    return {
        name: f"{firsts[place // 26]}{ascii_uppercase[place % 26]}"
        for place, name in enumerate(names)
    }


def times(comparison: Comparison) -> str:
    """Return the number of sequences, units and runs: `8 sequences, 5 runs each`."""
    n, sequences = len(comparison.sequences), _count(comparison)
    if n > len(comparison.units):
        sequences = f"{n} sequences ({sequences})"
    fewest, most = comparison.repetitions
    runs = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"{sequences}, {runs} run{'s' if most > 1 else ''} each"


def too_few(comparison: Comparison) -> str:
    """Return why there are no intervals; empty if there are enough units."""
    if len(comparison.units) >= MIN_UNITS:
        return ""
    reason = f"{_count(comparison)}: too few for intervals ({MIN_UNITS} needed)"
    if comparison.units.kind == "family":
        reason += "; --unit scene answers for new scenes of these families"
    return reason


def hold_together(comparison: Comparison) -> str:
    """Return the level of the intervals of all pairs."""
    m = len(comparison.pairs)
    return "the interval holds at 95 %" if m == 1 else f"the {m} intervals hold together at 95 %"


def answer_text(comparison: Comparison, pair: Pair) -> str:
    """Return the answer on a pair, with its reason if it is inconclusive."""
    reason = pair.answer.reason
    if not reason:
        return pair.answer.label
    if comparison.units.kind == "family" and pair.answer.interval is None:
        reason += "; --unit scene answers for new scenes of these families"
    return f"{pair.answer.label}: {reason}"


def wins_text(pair: Pair) -> str:
    """Return on how many units the first tracker is better: `7 of 8`."""
    return f"{pair.wins} of {len(pair.by_unit)}"


def same_boxes_text(comparison: Comparison, pair: Pair) -> str:
    """Return on how many sequences both gave the same boxes; empty if on none."""
    n = len(comparison.sequences)
    return f"same boxes on {pair.same_boxes} of {n} sequences" if pair.same_boxes else ""


def number(comparison: Comparison, value: float, *, signed: bool = False) -> str:
    """Return a score or a difference, scaled and rounded as the measure states."""
    measure = comparison.measure
    return f"{value * measure.scale:{'+' if signed else ''}.{measure.decimals}f}"


def between(comparison: Comparison, interval: Interval | None, *, signed: bool = False) -> str:
    """Return an interval of scores or differences."""
    if interval is None:
        return MISSING
    low, high = (number(comparison, end, signed=signed) for end in interval)
    return f"[{low}, {high}]"


def unit(comparison: Comparison) -> str:
    """Return a space and the measure's unit; nothing for pure numbers."""
    return f" {comparison.measure.unit}" if comparison.measure.unit else ""


def paragraph(comparison: Comparison) -> str:
    """Return the comparison in sentences for a paper: methods, failed runs and answers."""
    units, n = comparison.units, len(comparison.standings)
    sentences = [
        f"{n} tracker{'s were' if n > 1 else ' was'} compared by {comparison.measure.title} on "
        f"{times(comparison)}; the unit is the {units.kind}.",
        *_methods(comparison),
        *(f"{name}: {note}." for name, note in comparison.failures.items()),
    ]
    if comparison.not_repeatable:
        names = ", ".join(comparison.not_repeatable)
        sentences.append(f"Not repeatable (other boxes with the same seed): {names}.")
    if len(comparison.pairs) <= SENTENCE_PAIRS:
        sentences += [_sentence(comparison, pair) for pair in comparison.pairs]
    else:
        sentences += _summary(comparison)
    return " ".join(sentences)


def _count(comparison: Comparison) -> str:
    units = comparison.units
    return f"{len(units)} {units.plural if len(units) != 1 else units.kind}"


def _methods(comparison: Comparison) -> list[str]:
    """Return what the intervals are and what the answers mean."""
    if reason := too_few(comparison):
        return [f"{reason[:1].upper()}{reason[1:]}."]
    m = len(comparison.pairs)
    if not m:
        return []
    margin = f"±{comparison.margin * comparison.measure.scale:g}{unit(comparison)}"
    level = f"{100 * corrected_level(m):.4g} %"
    if m > 1:
        level += f" each (Bonferroni over {m} comparisons, together 95 %)"
    return [
        f"Intervals of mean differences over {comparison.units.plural} are the union of Student's "
        f"t interval and Hall's skewness-corrected one, at {level}, {comparison.units.scope}.",
        f"A tracker is better if its interval excludes 0 and is not inside {margin}; equivalence "
        f"needs an interval inside {margin} and 30 {comparison.units.plural}.",
    ]


_COMPARED = "compared with"

_VERBS = {
    "better": "was better than",
    "worse": "was worse than",
    "equivalent": "was equivalent to",
    "inconclusive": _COMPARED,
}


def _sentence(comparison: Comparison, pair: Pair) -> str:
    interval = pair.interval
    around = "" if interval is None else f" {between(comparison, interval, signed=True)}"
    difference = f"{number(comparison, pair.difference, signed=True)}{unit(comparison)}"
    details = [f"difference {difference}{around}", f"better on {wins_text(pair)}"]
    if same := same_boxes_text(comparison, pair):
        details.append(same)
    text = f"{pair.first} {_VERBS[pair.answer.label]} {pair.second}"
    if pair.answer.reason and interval is not None:
        text += f" was {answer_text(comparison, pair)}"
    return f"{text} ({', '.join(details)})."


def _summary(comparison: Comparison) -> list[str]:
    """Return one sentence per answer on the main pairs."""
    main = comparison.against or comparison.best.tracker
    turned = {"better": "worse", "worse": "better"}
    groups: dict[str, list[str]] = {}
    for pair in comparison.main_pairs:
        label, other = str(pair.answer.label), pair.second
        difference, interval = pair.difference, pair.interval
        if pair.first != main:
            label, other = turned.get(label, label), pair.first
            difference, interval = -difference, interval and Interval(-interval[1], -interval[0])
        details = f"{number(comparison, difference, signed=True)}{unit(comparison)}"
        if interval is not None:
            details += f" {between(comparison, interval, signed=True)}"
            details += f", {pair.answer.reason}" * bool(pair.answer.reason)
        groups.setdefault(label, []).append(f"{other} ({details})")
    return [
        f"{main} {verb} {'; '.join(groups[label])}{' was inconclusive' * (verb == _COMPARED)}."
        for label, verb in _VERBS.items()
        if label in groups
    ]
