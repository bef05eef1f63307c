"""What a comparison says: tables, JSON, and a paragraph ready for a paper."""

from collections.abc import Sequence
from math import isfinite, isnan
from string import ascii_uppercase
from typing import Any

import numpy as np
import pandas as pd

from bench.comparing.comparison import Answer, Comparison, Pair
from bench.statistics.intervals import Interval, mean_interval
from bench.statistics.paired import SIGNIFICANCE, smallest_p
from reports.tables import MISSING, Cell, Table

__all__ = ["as_data", "files", "letters", "paragraph", "screen", "spoken_of"]

SAID_PAIRS = 3
"""Pairs that get a sentence each; where there are more, one sentence an answer."""

SHOWN_PAIRS = 10
"""Pairs on a screen; where there are more, those with the best tracker are shown."""


def screen(comparison: Comparison) -> list[Table]:
    """Two tables for a terminal: how trackers stand, and what pairs of them show."""
    pairs = spoken_of(comparison)
    others = len(comparison.pairs) - len(pairs)
    left_out = [f"{others} other pairs are in --json and --folder."] if others else []
    return [_standings(comparison), _pair_table(comparison, pairs, left_out)]


def files(comparison: Comparison) -> list[Table]:
    """All tables, for a folder: also differences by sequence, and by knobs of the scenes."""
    made = [
        _standings(comparison),
        _pair_table(comparison, comparison.pairs, []),
        _sequences(comparison),
    ]
    return [*made, *([knobs] if (knobs := _knobs(comparison)).rows else [])]


def paragraph(comparison: Comparison) -> str:
    """What came out, in sentences for a paper; numbers and limits included."""
    n, tests = len(comparison.sequences), len(comparison.pairs)
    about = {
        "new sequences": "Intervals (95 %, Student's t) and tests (exact Wilcoxon signed-rank) are "
        "over sequences and tell of new ones like these",
        "new seeds": "Intervals (95 %) and tests (Welch's t) are over repetitions and tell of "
        "these sequences with new seeds, not of other sequences",
    }[comparison.question]
    holm = f"; p after Holm's correction for {tests} comparisons" if tests > 1 else ""
    said = [
        f"{len(comparison.standings)} trackers were compared by {comparison.measure.title} on "
        f"{_times(comparison)}. {about}{holm}."
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


def spoken_of(comparison: Comparison) -> list[Pair]:
    """Pairs that are spoken of, the better tracker first: all of a few, else those with the best.

    Of two trackers the one that was named first stays first.
    """
    if len(comparison.pairs) == 1:
        return list(comparison.pairs)
    means = {standing.tracker: standing.rank for standing in comparison.standings}
    best = comparison.best.tracker
    sign = 1 if comparison.measure.direction == "higher" else -1
    pairs = [
        pair if sign * pair.difference >= 0 else pair.swapped()
        for pair in comparison.pairs
        if len(comparison.pairs) <= SHOWN_PAIRS or best in (pair.first, pair.second)
    ]
    return sorted(pairs, key=lambda pair: (pair.first != best, means[pair.first]))


def as_data(comparison: Comparison) -> dict[str, Any]:
    """All of it for `--json`; scores unscaled, gaps null."""
    critical = comparison.critical_difference
    return {
        "measure": comparison.measure.name,
        "direction": comparison.measure.direction,
        "margin": comparison.margin,
        "question": comparison.question,
        "sequences": list(comparison.sequences),
        "repetitions": list(comparison.repetitions),
        "smallest_p": smallest_p(len(comparison.sequences)),
        "critical_difference": None if isnan(critical) else critical,
        "trackers": [
            {
                "tracker": standing.tracker,
                "mean": standing.mean,
                "interval": _listed(standing.interval),
                "rank": standing.rank,
                "contender": standing.contender,
                "kept": standing.kept if isfinite(standing.kept) else None,
                "milliseconds": standing.milliseconds if isfinite(standing.milliseconds) else None,
                "timed": standing.timed,
            }
            for standing in comparison.standings
        ],
        "pairs": [
            {
                "first": pair.first,
                "second": pair.second,
                "answer": pair.answer,
                "difference": pair.difference,
                "interval": _listed(pair.interval),
                "probability_better": pair.probability,
                "probability_interval": list(pair.probability_interval),
                "p": pair.p,
                "p_holm": pair.adjusted,
                "sequences_needed": int(pair.needed) if isfinite(pair.needed) else None,
                "time_to_failure_p": pair.loss_p,
                "differences": pair.differences.tolist(),
            }
            for pair in comparison.pairs
        ],
        "paragraph": paragraph(comparison),
    }


def _standings(comparison: Comparison) -> Table:
    measure = comparison.measure
    rows, data = [], []
    for letter, standing in zip(letters(comparison), comparison.standings, strict=True):
        approximate = "" if standing.timed else "~"
        time = f"{approximate}{standing.milliseconds:.3g}"
        rows.append(
            [
                Cell(letter),
                Cell(standing.tracker),
                Cell(_number(comparison, standing.mean), standing.contender),
                Cell(_interval(comparison, standing.interval)),
                Cell(f"{standing.rank:.1f}"),
                Cell(f"{100 * standing.kept:.0f}" if isfinite(standing.kept) else MISSING),
                Cell(time if isfinite(standing.milliseconds) else MISSING),
            ]
        )
        data.append({"letter": letter, **vars(standing), **_ends(standing.interval)})
    notes = ["* can't be told from the best."]
    if isfinite(critical := comparison.critical_difference):
        notes.append(f"Mean ranks that differ by less than {critical:.2f} can't be told apart.")
    if not all(standing.timed for standing in comparison.standings):
        notes.append("~ of the accuracy runs, beside other work; `run --timing` measures.")
    return Table(
        name="comparison",
        caption=(
            f"{_times(comparison)}. 95 % intervals "
            + {
                "new sequences": "for new sequences like these.",
                "new seeds": "for these sequences with new seeds.",
            }[comparison.question]
        ),
        heads=["", "tracker", measure.head, "95 %", "rank", "never lost [%]", "ms a frame"],
        n_labels=2,
        rows=rows,
        notes=notes,
        data=pd.DataFrame(data).drop(columns="interval"),
    )


def _pair_table(comparison: Comparison, pairs: Sequence[Pair], notes: list[str]) -> Table:
    letter = dict(zip(comparison.scores, letters(comparison), strict=True))
    rows, data = [], []
    for pair in pairs:
        rows.append(
            [
                Cell(f"{letter[pair.first]} - {letter[pair.second]}"),
                Cell(pair.answer + _needed(pair)),
                Cell(_number(comparison, pair.difference, signed=True)),
                Cell(_interval(comparison, pair.interval, signed=True)),
                Cell(f"{pair.probability:.2f} {_plain(pair.probability_interval)}"),
                Cell(_p(pair.adjusted)),
                Cell(_p(pair.loss_p)),
            ]
        )
        told = {key: value for key, value in vars(pair).items() if key != "differences"}
        around = pair.probability_interval
        data.append(
            {
                **told,
                "difference": pair.difference,
                **_ends(pair.interval),
                "probability_low": around.low,
                "probability_high": around.high,
            }
        )
    margin = comparison.margin * comparison.measure.scale
    return Table(
        name="comparison-pairs",
        caption=(
            "The first against the second. Practically equal: interval within "
            f"±{margin:g}{_unit(comparison)}."
        ),
        heads=[
            "pair",
            "the first is",
            "difference",
            "95 %",
            "P(better) 95 %",
            "p",
            "p of losses",
        ],
        n_labels=2,
        rows=rows,
        notes=[*notes, *_limits(comparison)],
        data=pd.DataFrame(data).drop(columns=["interval", "probability_interval"]),
    )


def _limits(comparison: Comparison) -> list[str]:
    """What so many sequences can't show."""
    n, tests = len(comparison.sequences), len(comparison.pairs)
    if comparison.question == "new seeds":
        if all(pair.interval is None for pair in comparison.pairs):
            return [f"{n} sequences say nothing of new ones: give 5 or more, or --seeds."]
        return [f"{n} sequences say nothing of new ones: give 5 or more."]
    least = smallest_p(n) * tests
    if least >= SIGNIFICANCE:
        enough = next(k for k in range(n, 200) if smallest_p(k) * tests < SIGNIFICANCE)
        return [
            f"{n} sequences can't show a difference: the smallest p is {min(1.0, least):.2g} "
            f"({tests} comparison{'s' if tests > 1 else ''}); {enough} or more can."
        ]
    return []


def _sequences(comparison: Comparison) -> Table:
    """Means and spread over repetitions of every tracker on every sequence."""
    heads = ["sequence", *comparison.scores]
    rows, data = [], []
    for position, sequence in enumerate(comparison.sequences):
        row = [Cell(sequence)]
        for tracker, found in comparison.scores.items():
            runs = found[position]
            spread = float(runs.std(ddof=1)) if len(runs) > 1 else float("nan")
            text = _number(comparison, float(runs.mean()))
            if isfinite(spread):
                text += f" ±{_number(comparison, spread)}"
            row.append(Cell(text))
            data.append(
                {
                    "sequence": sequence,
                    "tracker": tracker,
                    "mean": float(runs.mean()),
                    "standard_deviation": spread,
                    "runs": len(runs),
                }
            )
        rows.append(row)
    return Table(
        name="comparison-sequences",
        caption=f"{comparison.measure.head} by sequence, ± standard deviation over repetitions.",
        heads=heads,
        n_labels=1,
        rows=rows,
        data=pd.DataFrame(data),
    )


def _knobs(comparison: Comparison) -> Table:
    letter = dict(zip(comparison.scores, letters(comparison), strict=True))
    rows, data = [], []
    for pair in spoken_of(comparison):
        for (knob, value), differences in comparison.by_knob(pair).items():
            interval = mean_interval(differences) if len(differences) > 1 else None
            mean = float(np.mean(differences))
            rows.append(
                [
                    Cell(f"{letter[pair.first]} - {letter[pair.second]}"),
                    Cell(f"{knob}={value}"),
                    Cell(str(len(differences))),
                    Cell(_number(comparison, mean, signed=True)),
                    Cell(_interval(comparison, interval, signed=True)),
                ]
            )
            data.append(
                {
                    "first": pair.first,
                    "second": pair.second,
                    "knob": knob,
                    "value": value,
                    "sequences": len(differences),
                    "difference": mean,
                    **_ends(interval),
                }
            )
    return Table(
        name="comparison-knobs",
        caption=f"Differences of {comparison.measure.head} by knobs of the scenes.",
        heads=["pair", "knob", "sequences", "difference", "95 %"],
        n_labels=2,
        rows=rows,
        data=pd.DataFrame(data),
    )


_VERBS = {
    "better": "was better than",
    "worse": "was worse than",
    "practically equal": "was practically equal to",
    "cannot tell": "could not be told from",
}


def _sentence(comparison: Comparison, pair: Pair) -> str:
    around = (
        "" if pair.interval is None else f" {_interval(comparison, pair.interval, signed=True)}"
    )
    difference = f"{_number(comparison, pair.difference, signed=True)}{_unit(comparison)}"
    text = (
        f"{pair.first} {_VERBS[pair.answer]} {pair.second} "
        f"(difference {difference}{around}, p {_equals(pair.adjusted)})"
    )
    if isfinite(pair.needed):
        text += f"; about {pair.needed:.0f} sequences would tell"
    return text + "."


def _summed(comparison: Comparison, kind: Answer, pairs: Sequence[Pair]) -> str:
    """One sentence on all that the best tracker stands alike to."""
    shown = sorted((pair.difference for pair in pairs), key=abs)
    ends = dict.fromkeys(_number(comparison, end, signed=True) for end in (shown[0], shown[-1]))
    largest = max(pair.adjusted for pair in pairs)
    level = f", all p ≤ {_p(largest)}" if kind in ("better", "worse") and largest >= 0.001 else ""
    level = ", all p < .001" if kind in ("better", "worse") and largest < 0.001 else level
    return (
        f"{pairs[0].first} {_VERBS[kind]} {', '.join(pair.second for pair in pairs)} (difference"
        f"{'s' if len(pairs) > 1 else ''} {' to '.join(ends)}{_unit(comparison)}{level})."
    )


def _times(comparison: Comparison) -> str:
    """How many sequences, and how often each."""
    fewest, most = comparison.repetitions
    runs = f"{most}" if fewest == most else f"{fewest} to {most}"
    plural = "" if runs == "1" else "s"
    return f"{len(comparison.sequences)} sequences with {runs} repetition{plural} each"


def _needed(pair: Pair) -> str:
    if isnan(pair.needed):
        return ""
    return f" (~{pair.needed:.0f} seq.)" if pair.needed < 1000 else " (> 1000 seq.)"


def letters(comparison: Comparison) -> list[str]:
    """Letters for the trackers: A to Z, then AA, AB and so on."""
    firsts = ["", *ascii_uppercase]
    return [
        f"{firsts[number // 26]}{ascii_uppercase[number % 26]}"
        for number in range(len(comparison.standings))
    ]


def _number(comparison: Comparison, value: float, *, signed: bool = False) -> str:
    measure = comparison.measure
    return f"{value * measure.scale:{'+' if signed else ''}.{measure.decimals}f}"


def _interval(comparison: Comparison, interval: Interval | None, *, signed: bool = False) -> str:
    if interval is None:
        return MISSING
    low, high = (_number(comparison, end, signed=signed) for end in interval)
    return f"[{low}, {high}]"


def _plain(interval: Interval) -> str:
    return f"[{interval.low:.2f}, {interval.high:.2f}]"


def _p(value: float) -> str:
    return "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0") if value < 1 else "1"


def _equals(p: float) -> str:
    return _p(p) if p < 0.001 else f"= {_p(p)}"


def _unit(comparison: Comparison) -> str:
    return f" {comparison.measure.unit}" if comparison.measure.unit else ""


def _ends(interval: Interval | None) -> dict[str, float]:
    low, high = interval if interval is not None else (float("nan"), float("nan"))
    return {"low": low, "high": high}


def _listed(interval: Interval | None) -> list[float] | None:
    return None if interval is None else list(interval)
