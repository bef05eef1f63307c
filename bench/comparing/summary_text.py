"""A comparison in words: captions, answers and the paragraph for a paper."""

from trackmark.bench.comparing.comparison import Comparison, Pair
from trackmark.bench.statistics.rules import MIN_UNITS, MIN_UNITS_FOR_SMALL, corrected_level
from trackmark.reports.tables import MISSING

SENTENCE_PAIRS = 3
"""Pairs that get a sentence each; if there are more, one sentence per answer."""

SHOWN_PAIRS = 10
"""Pairs on a screen; if there are more, those with the best tracker are shown."""

COMPARED = "compared with"

VERBS = {
    "better": "was better than",
    "worse": "was worse than",
    "equivalent": "was equivalent to",
    "inconclusive": COMPARED,
}


def shown_pairs(comparison: Comparison) -> list[Pair]:
    """Return all pairs, or those with the best tracker if there are too many for a screen."""
    if len(comparison.pairs) <= SHOWN_PAIRS:
        return list(comparison.pairs)
    return comparison.main_pairs


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
    remedy = comparison.units.remedy
    return f"{_count(comparison)}: too few for intervals ({MIN_UNITS} needed){remedy}"


def answer_text(pair: Pair) -> str:
    """Return the answer on a pair, with its reason if it is inconclusive."""
    return ": ".join(filter(None, [pair.answer.label, pair.answer.reason]))


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


def between(
    comparison: Comparison, interval: tuple[float, float] | None, *, signed: bool = False
) -> str:
    """Return an interval of scores or differences."""
    if interval is None:
        return MISSING
    low, high = (number(comparison, end, signed=signed) for end in interval)
    return f"[{low}, {high}]"


def margin_text(comparison: Comparison) -> str:
    """Return the margin with its unit: `±0.5 px`."""
    return f"±{comparison.measure.margin * comparison.measure.scale:g}{_unit(comparison)}"


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


def _unit(comparison: Comparison) -> str:
    return f" {comparison.measure.unit}" if comparison.measure.unit else ""


def _methods(comparison: Comparison) -> list[str]:
    """Return what the intervals are and what the answers mean."""
    if reason := too_few(comparison):
        return [f"{reason[:1].upper()}{reason[1:]}."]
    m, units, margin = len(comparison.pairs), comparison.units, margin_text(comparison)
    if not m:
        return []
    level = f"{100 * corrected_level(m):.4g} %"
    if m > 1:
        level += f" each (Bonferroni over {m} comparisons, together 95 %)"
    return [
        f"Intervals of mean differences over {units.plural} are the union of Student's t interval "
        f"and Hall's skewness-corrected one, at {level}, {units.scope}.",
        f"A tracker is better if its interval excludes 0 and is not inside {margin}; equivalence "
        f"needs an interval inside {margin} and {MIN_UNITS_FOR_SMALL} {units.plural}.",
    ]


def _sentence(comparison: Comparison, pair: Pair) -> str:
    difference = _difference_text(comparison, pair.difference, pair.interval)
    details = [f"difference {difference}", f"better on {wins_text(pair)}"]
    if same := same_boxes_text(comparison, pair):
        details.append(same)
    text = f"{pair.first} {VERBS[pair.answer.label]} {pair.second}"
    if pair.answer.reason and pair.interval is not None:
        text += f" was {answer_text(pair)}"
    return f"{text} ({', '.join(details)})."


def _summary(comparison: Comparison) -> list[str]:
    """Return one sentence per answer on the main pairs."""
    opposites = {"better": "worse", "worse": "better"}
    groups: dict[str, list[str]] = {}
    for pair in comparison.main_pairs:
        label, other = str(pair.answer.label), pair.second
        difference = pair.difference
        interval: tuple[float, float] | None = pair.interval
        if pair.first != comparison.main:
            label, other = opposites.get(label, label), pair.first
            difference, interval = -difference, interval and (-interval[1], -interval[0])
        details = _difference_text(comparison, difference, interval)
        if interval is not None and pair.answer.reason:
            details += f", {pair.answer.reason}"
        groups.setdefault(label, []).append(f"{other} ({details})")
    sentences = [
        f"{comparison.main} {verb} {'; '.join(groups[label])}"
        f"{' was inconclusive' * (verb == COMPARED)}."
        for label, verb in VERBS.items()
        if label in groups
    ]
    if others := len(comparison.pairs) - len(comparison.main_pairs):
        sentences.append(f"The other {others} pairs are in the table of pairs.")
    return sentences


def _difference_text(
    comparison: Comparison, difference: float, interval: tuple[float, float] | None
) -> str:
    text = f"{number(comparison, difference, signed=True)}{_unit(comparison)}"
    return text if interval is None else f"{text} {between(comparison, interval, signed=True)}"
