"""What a comparison says, as tables and as JSON."""

import json
from collections.abc import Sequence
from math import isfinite, isnan, nan
from typing import Any

import numpy as np
import pandas as pd

from bench.comparing.comparison import Comparison
from bench.comparing.pairs import Pair
from bench.comparing.words import (
    between,
    letters,
    number,
    p_value,
    paragraph,
    share_between,
    spoken_of,
    times,
    unit,
)
from bench.reporting.against import as_data as curves_as_data
from bench.reporting.against import attribute_table
from bench.reporting.doubt import LEAST_FOR_NEW, best_of, bounded_difference
from bench.statistics.intervals import Interval
from bench.statistics.paired import SIGNIFICANCE, smallest_p
from reports.tables import MISSING, Cell, Table

__all__ = ["as_data", "files", "screen"]


def screen(comparison: Comparison) -> list[Table]:
    """Tables for a terminal: how trackers stand, and what pairs of them show.

    Also against what the pairs' differences rise or fall, where attributes were measured.
    """
    pairs = spoken_of(comparison)
    others = len(comparison.pairs) - len(pairs)
    left_out = [f"{others} other pairs are in --json and --folder."] if others else []
    made = [_standings(comparison), _pair_table(comparison, pairs, left_out)]
    return [*made, _gains(comparison)] if comparison.measured else made


def files(comparison: Comparison) -> list[Table]:
    """All tables, for a folder: also differences by sequence, and by knob and attribute."""
    made = [
        _standings(comparison),
        _pair_table(comparison, spoken_of(comparison, whole=True), [], named=True),
        _sequences(comparison),
    ]
    if (parts := _parts(comparison)).rows:
        made.append(parts)
    if comparison.measured:
        name = "comparison-attributes"
        scores = attribute_table(comparison.curves, comparison.measure, "tracker", name)
        made += [scores, _gains(comparison)]
    return made


def as_data(comparison: Comparison) -> dict[str, Any]:
    """All of it for `--json`; scores unscaled, gaps null."""
    critical = comparison.critical_difference
    return {
        "measure": comparison.measure.name,
        "title": comparison.measure.title,
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
                "p": pair.p if pair.by_chance else None,
                "p_holm": pair.adjusted if pair.by_chance else None,
                "needed": int(pair.needed) if isfinite(pair.needed) else None,
                "time_to_failure_p": pair.loss_p,
                "differences": pair.differences.tolist(),
            }
            for pair in comparison.pairs
        ],
        "parts": json.loads(_parts(comparison).data.to_json(orient="records")),
        "attributes": {
            "measured": {
                name: [value if isfinite(value) else None for value in values.tolist()]
                for name, values in comparison.measured.items()
            },
            "trackers": curves_as_data(comparison.curves, "tracker"),
            "pairs": curves_as_data(comparison.curves_of(spoken_of(comparison)), "pair"),
        },
        "paragraph": paragraph(comparison),
    }


def _standings(comparison: Comparison) -> Table:
    measure = comparison.measure
    rows, data = [], []
    told = any(pair.interval is not None for pair in comparison.pairs)
    means = [standing.mean for standing in comparison.standings]
    marked = [one.contender for one in comparison.standings] if told else best_of(means, measure)
    for letter, standing, best in zip(
        letters(comparison), comparison.standings, marked, strict=True
    ):
        approximate = "" if standing.timed else "~"
        time = f"{approximate}{standing.milliseconds:.3g}"
        rows.append(
            [
                Cell(letter),
                Cell(standing.tracker),
                Cell(number(comparison, standing.mean), best),
                Cell(between(comparison, standing.interval)),
                Cell(f"{standing.rank:.1f}"),
                Cell(f"{100 * standing.kept:.0f}" if isfinite(standing.kept) else MISSING),
                Cell(time if isfinite(standing.milliseconds) else MISSING),
            ]
        )
        data.append({"letter": letter, **vars(standing), **_ends(standing.interval)})
    notes = [
        "Marked: can't be told from the best, or practically equal to it."
        if told
        else "Marked: the best mean; nothing was repeated that could say how sure it is."
    ]
    if isfinite(critical := comparison.critical_difference):
        notes.append(f"Mean ranks that differ by less than {critical:.2f} can't be told apart.")
    if not all(standing.timed for standing in comparison.standings):
        notes.append("~: of the accuracy runs, beside other work (run --timing measures).")
    return Table(
        name="comparison",
        caption=f"{times(comparison)}. {_meaning(comparison)}",
        heads=["", "tracker", measure.head, "95 %", "rank", "never lost [%]", "ms a frame"],
        n_labels=2,
        rows=rows,
        ranks=[0, 1, 2, 4, 3],
        notes=notes,
        data=pd.DataFrame(data).drop(columns="interval"),
    )


def _meaning(comparison: Comparison) -> str:
    """What intervals tell of."""
    of = {
        "new sequences": "new sequences like these",
        "new seeds": "these sequences with new seeds",
    }
    return f"95 % intervals for {of[comparison.question]}."


def _pair_table(
    comparison: Comparison, pairs: Sequence[Pair], notes: list[str], *, named: bool = False
) -> Table:
    """Answers on pairs; trackers are called by their letters, or `named` in full."""
    called = dict(zip(comparison.scores, letters(comparison), strict=True))
    about = "The first against the second."
    if named:
        called = {name: name for name in called}
        about = (
            f"The first against the second by {comparison.measure.head}, on {times(comparison)}: "
            f"mean difference. {_meaning(comparison)}"
        )
    rows, data = [], []
    for pair in pairs:
        rows.append(
            [
                Cell(f"{called[pair.first]} - {called[pair.second]}"),
                Cell(pair.answer + _needed(pair)),
                Cell(number(comparison, pair.difference, signed=True)),
                Cell(between(comparison, pair.interval, signed=True)),
                Cell(_often(pair)),
                Cell(p_value(pair.adjusted) if pair.by_chance else MISSING),
                Cell(p_value(pair.loss_p)),
            ]
        )
        told = {key: value for key, value in vars(pair).items() if key != "differences"}
        around = pair.probability_interval
        data.append(
            {
                **told,
                "p": pair.p if pair.by_chance else nan,
                "adjusted": pair.adjusted if pair.by_chance else nan,
                "difference": pair.difference,
                **_ends(pair.interval),
                "probability_low": around.low,
                "probability_high": around.high,
            }
        )
    margin = comparison.margin * comparison.measure.scale
    return Table(
        name="comparison-pairs",
        caption=(f"{about} Practically equal: interval within ±{margin:g}{unit(comparison)}."),
        heads=[
            "pair",
            "the first is",
            _difference_head(comparison),
            "95 %",
            "P(better) 95 %",
            "p",
            "p of losses",
        ],
        n_labels=2,
        rows=rows,
        ranks=[0, 1, 3, 2, 4],
        notes=[*notes, *_limits(comparison)],
        data=pd.DataFrame(data).drop(columns=["interval", "probability_interval"]),
    )


def _often(pair: Pair) -> str:
    """On how many sequences the first was better; of a few no share of all that there may be."""
    n = len(pair.differences)
    if n < LEAST_FOR_NEW:
        return f"on {pair.probability * n:g} of {n}"
    return f"{pair.probability:.2f} {share_between(pair.probability_interval)}"


def _limits(comparison: Comparison) -> list[str]:
    """What so many sequences can't show."""
    n, tests = len(comparison.sequences), len(comparison.pairs)
    told = []
    if any(isfinite(pair.needed) for pair in comparison.pairs):
        what = "sequences" if comparison.question == "new sequences" else "repetitions"
        told = [f"(~N): about N {what} would show it in four cases of five."]
    if comparison.question == "new sequences" and comparison.repetitions[1] > 1:
        told.append("p of losses is over runs: of these sequences, with new seeds.")
    if comparison.question == "new seeds":
        if all(pair.interval is None for pair in comparison.pairs):
            return [
                f"Nothing was repeated: give {LEAST_FOR_NEW} sequences or more (or --seeds, for "
                "trackers that draw random numbers)."
            ]
        if not all(pair.by_chance for pair in comparison.pairs):
            told.append(f"{MISSING}: neither was repeated; run again, they score the same.")
        return [*told, "Other sequences than these may show something else."]
    least = smallest_p(n) * tests
    if least >= SIGNIFICANCE:
        enough = next(k for k in range(n, 200) if smallest_p(k) * tests < SIGNIFICANCE)
        return [
            *told,
            f"{n} sequences can't show a difference: the smallest p is {min(1.0, least):.2g} "
            f"({tests} comparison{'s' if tests > 1 else ''}); {enough} or more can.",
        ]
    return told


def _sequences(comparison: Comparison) -> Table:
    """Means and spread over repetitions of every tracker on every sequence."""
    heads = ["sequence", *comparison.scores]
    rows, data = [], []
    for position, sequence in enumerate(comparison.sequences):
        row = [Cell(sequence)]
        for tracker, found in comparison.scores.items():
            runs = found[position]
            spread = float(runs.std(ddof=1)) if len(runs) > 1 else float("nan")
            text = number(comparison, float(runs.mean()))
            if isfinite(spread):
                text += f" ±{number(comparison, spread)}"
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


def _parts(comparison: Comparison) -> Table:
    rows, data = [], []
    for pair in spoken_of(comparison):
        for (knob, value), differences in comparison.by_part(pair).items():
            interval = (
                bounded_difference(comparison.measure, differences)
                if len(differences) > 1
                else None
            )
            mean = float(np.mean(differences))
            rows.append(
                [
                    Cell(f"{pair.first} - {pair.second}"),
                    Cell(f"{knob}={value}"),
                    Cell(str(len(differences))),
                    Cell(number(comparison, mean, signed=True)),
                    Cell(between(comparison, interval, signed=True)),
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
        name="comparison-parts",
        caption=(
            f"Differences of {comparison.measure.head} by knob and by attribute (of sequences in "
            "which it occurs), the first of a pair minus the second: means over n sequences, each "
            "counting once, with 95 % intervals for new sequences like these."
        ),
        heads=["pair", "part", "n", _difference_head(comparison), "95 %"],
        n_labels=2,
        rows=rows,
        data=pd.DataFrame(data),
    )


def _difference_head(comparison: Comparison) -> str:
    unit = comparison.measure.unit
    return f"difference [{unit}]" if unit else "difference"


def _gains(comparison: Comparison) -> Table:
    """Against what the differences of pairs rise or fall."""
    curves = comparison.curves_of(spoken_of(comparison))
    name = "comparison-attribute-differences"
    return attribute_table(curves, comparison.measure, "pair", name)


def _needed(pair: Pair) -> str:
    if isnan(pair.needed):
        return ""
    return f" (~{pair.needed:.0f})" if pair.needed < 1000 else " (> 1000)"


def _ends(interval: Interval | None) -> dict[str, float]:
    low, high = interval if interval is not None else (float("nan"), float("nan"))
    return {"low": low, "high": high}


def _listed(interval: Interval | None) -> list[float] | None:
    return None if interval is None else list(interval)
