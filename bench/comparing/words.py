"""A comparison in words: the paragraph for a paper, and how numbers are written."""

from collections.abc import Sequence
from math import isfinite
from string import ascii_uppercase

from bench.comparing.comparison import Comparison
from bench.comparing.pairs import Answer, Pair
from bench.reporting.doubt import p_value
from bench.statistics.intervals import Interval
from bench.statistics.paired import SIGNIFICANCE, smallest_p
from reports.tables import MISSING

__all__ = [
    "between",
    "equals",
    "letters",
    "number",
    "p_value",
    "paragraph",
    "share_between",
    "spoken_of",
    "times",
    "unit",
]

SAID_PAIRS = 3
"""Pairs that get a sentence each; where there are more, one sentence an answer."""

SHOWN_PAIRS = 10
"""Pairs on a screen; where there are more, those with the best tracker are shown."""


def paragraph(comparison: Comparison) -> str:
    """What came out, in sentences for a paper; numbers and limits included."""
    n, tests = len(comparison.sequences), len(comparison.pairs)
    about = {
        "new sequences": "Intervals (95 %, Student's t) and tests (exact Wilcoxon signed-rank) are "
        "over sequences and tell of new ones like these",
        "new seeds": "Intervals (95 %) and tests (Welch's t) are over repetitions and tell of "
        "these sequences with new seeds, not of other sequences",
    }[comparison.question]
    if all(pair.interval is None for pair in comparison.pairs):
        about = "Nothing was repeated, so that nothing says how sure the differences are"
        tests = 1
    holm = f"; p after Holm's correction for {tests} comparisons" if tests > 1 else ""
    said = [
        f"{len(comparison.standings)} trackers were compared by {comparison.measure.title} on "
        f"{times(comparison)}. {about}{holm}."
    ]
    pairs = spoken_of(comparison)
    kinds = sorted({pair.answer for pair in pairs}, key=list(_VERBS).index)
    if tests <= SAID_PAIRS:
        said += [_sentence(comparison, pair) for pair in pairs]
    else:
        best = [pair for pair in pairs if pair.first == comparison.best.tracker]
        said += [
            _summed(comparison, kind, [pair for pair in best if pair.answer == kind])
            for kind in kinds
            if any(pair.answer == kind for pair in best)
        ]
    if comparison.question == "new sequences":
        least = smallest_p(n) * tests
        said.append(
            f"With {n} sequences the smallest p that can come out is {min(1.0, least):.2g}"
            + (": no difference could be shown." if least >= SIGNIFICANCE else ".")
        )
    return " ".join(said)


def spoken_of(comparison: Comparison, *, whole: bool = False) -> list[Pair]:
    """Pairs that are spoken of, the better tracker first: all of a few, else those with the best.

    Of two trackers the one that was named first stays first. `whole`: all pairs, in this order.
    """
    if len(comparison.pairs) == 1:
        return list(comparison.pairs)
    ranks = {standing.tracker: standing.rank for standing in comparison.standings}
    best = comparison.best.tracker
    sign = 1 if comparison.measure.direction == "higher" else -1
    whole = whole or len(comparison.pairs) <= SHOWN_PAIRS
    pairs = [
        pair if sign * pair.difference >= 0 else pair.swapped()
        for pair in comparison.pairs
        if whole or best in (pair.first, pair.second)
    ]
    return sorted(pairs, key=lambda pair: (pair.first != best, ranks[pair.first]))


_VERBS = {
    "better": "was better than",
    "worse": "was worse than",
    "practically equal": "was practically equal (within ±{margin}) to",
    "cannot tell": "could not be told from",
}


def _verb(comparison: Comparison, answer: Answer) -> str:
    margin = f"{comparison.margin * comparison.measure.scale:g}{unit(comparison)}"
    return _VERBS[answer].format(margin=margin)


def _sentence(comparison: Comparison, pair: Pair) -> str:
    what = "sequences" if comparison.question == "new sequences" else "repetitions"
    around = "" if pair.interval is None else f" {between(comparison, pair.interval, signed=True)}"
    difference = f"{number(comparison, pair.difference, signed=True)}{unit(comparison)}"
    p = f", p {equals(pair.adjusted)}" if pair.by_chance else ""
    verb = _verb(comparison, pair.answer)
    text = f"{pair.first} {verb} {pair.second} (difference {difference}{around}{p})"
    if isfinite(pair.needed):
        text += f"; about {pair.needed:.0f} {what} would show it in four cases of five"
    return text + "."


def _summed(comparison: Comparison, kind: Answer, pairs: Sequence[Pair]) -> str:
    """One sentence on all that the best tracker stands alike to."""
    shown = sorted((pair.difference for pair in pairs), key=abs)
    ends = dict.fromkeys(number(comparison, end, signed=True) for end in (shown[0], shown[-1]))
    levels = [pair.adjusted for pair in pairs if pair.by_chance]
    largest, level = max(levels, default=1.0), ""
    if kind in ("better", "worse") and len(levels) == len(pairs):
        level = ", all p < .001" if largest < 0.001 else f", all p ≤ {p_value(largest)}"
    others = ", ".join(pair.second for pair in pairs)
    return (
        f"{pairs[0].first} {_verb(comparison, kind)} {others} (difference"
        f"{'s' if len(pairs) > 1 else ''} {' to '.join(ends)}{unit(comparison)}{level})."
    )


def times(comparison: Comparison) -> str:
    """How many sequences, and how often each."""
    fewest, most = comparison.repetitions
    runs = f"{most}" if fewest == most else f"{fewest} to {most}"
    plural = "" if runs == "1" else "s"
    return f"{len(comparison.sequences)} sequences with {runs} repetition{plural} each"


def letters(comparison: Comparison) -> list[str]:
    """Letters for the trackers: A to Z, then AA, AB and so on."""
    firsts = ["", *ascii_uppercase]
    return [
        f"{firsts[number // 26]}{ascii_uppercase[number % 26]}"
        for number in range(len(comparison.standings))
    ]


def number(comparison: Comparison, value: float, *, signed: bool = False) -> str:
    """A score or a difference, scaled and rounded as the measure says."""
    measure = comparison.measure
    return f"{value * measure.scale:{'+' if signed else ''}.{measure.decimals}f}"


def between(comparison: Comparison, interval: Interval | None, *, signed: bool = False) -> str:
    """An interval of scores or differences."""
    if interval is None:
        return MISSING
    low, high = (number(comparison, end, signed=signed) for end in interval)
    return f"[{low}, {high}]"


def share_between(interval: Interval) -> str:
    """An interval of a share in [0, 1]."""
    return f"[{interval.low:.2f}, {interval.high:.2f}]"


def equals(p: float) -> str:
    """`= .031`, or `< .001`."""
    return p_value(p) if p < 0.001 else f"= {p_value(p)}"


def unit(comparison: Comparison) -> str:
    """A space and the measure's unit; nothing for pure numbers."""
    return f" {comparison.measure.unit}" if comparison.measure.unit else ""
