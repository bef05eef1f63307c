"""A comparison as tables and as JSON."""

import json
import textwrap
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd

from bench.comparing.comparison import Comparison
from bench.comparing.pairwise import Pair
from bench.comparing.summary_text import (
    answer_text,
    between,
    called,
    hold_together,
    number,
    paragraph,
    same_boxes_text,
    shown_pairs,
    times,
    too_few,
    unit,
    wins_text,
)
from bench.statistics.intervals import Interval
from bench.statistics.rules import interval_or_none
from reports.printable import width
from reports.tables import MISSING, Cell, Table

__all__ = ["as_data", "files", "screen"]


def screen(comparison: Comparison) -> list[Table]:
    """Return tables for a terminal: standings and pairs.

    With too few units for intervals, differences by unit replace the answers on pairs.
    """
    made = [_standings(comparison, called(comparison))]
    if comparison.pairs and too_few(comparison):
        made.append(_differences(comparison))
    elif comparison.pairs:
        made.append(_short_pairs(comparison))
    return made


def files(comparison: Comparison) -> list[Table]:
    """Return all tables, for a folder: also scores by sequence, and differences by part."""
    made = [_standings(comparison, {})]
    made += [_pair_table(comparison)] if comparison.pairs else []
    made.append(_sequences(comparison))
    if (parts := _parts(comparison)).rows:
        made.append(parts)
    return made


def as_data(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison for `--json`; scores unscaled, gaps null."""
    units = comparison.units
    return {
        "measure": comparison.measure.name,
        "title": comparison.measure.title,
        "direction": comparison.measure.direction,
        "margin": comparison.margin,
        "unit": units.kind,
        "units": list(units.labels),
        "scope": units.scope,
        "sequences": list(comparison.sequences),
        "repetitions": list(comparison.repetitions),
        "comparisons": len(comparison.pairs),
        "trackers": [
            {
                "tracker": standing.tracker,
                "mean": standing.mean,
                "interval": _listed(standing.interval),
                "contender": standing.contender,
                "kept": _or_none(standing.kept),
                "milliseconds": _or_none(standing.milliseconds),
                "timed": standing.timed,
                "failures": comparison.failures.get(standing.tracker),
                "repeatable": standing.tracker not in comparison.not_repeatable,
            }
            for standing in comparison.standings
        ],
        "left_out": {name: comparison.failures[name] for name in comparison.left_out},
        "pairs": [
            {
                **_pair_data(pair),
                "p": _or_none(pair.answer.p),
                "needed": _or_none(pair.answer.needed),
                "interval": _listed(pair.interval),
                "differences": pair.differences.tolist(),
                "unit_differences": pair.by_unit.tolist(),
            }
            for pair in comparison.pairs
        ],
        "parts": json.loads(_parts(comparison).data.to_json(orient="records")),
        "paragraph": paragraph(comparison),
    }


def _standings(comparison: Comparison, names: dict[str, str]) -> Table:
    """Return means of the trackers; `names`: what pairs call them, which a column says."""
    measure = comparison.measure
    lettered = any(key != name for key, name in names.items())
    rows, data = [], []
    for standing in comparison.standings:
        time = f"{'' if standing.timed else '~'}{standing.milliseconds:.3g}"
        remark = " (not repeatable)" * (standing.tracker in comparison.not_repeatable)
        rows.append(
            [
                *([Cell(names[standing.tracker])] if lettered else []),
                Cell(standing.tracker + remark),
                Cell(number(comparison, standing.mean), standing.contender),
                Cell(between(comparison, standing.interval)),
                Cell(f"{100 * standing.kept:.0f}" if isfinite(standing.kept) else MISSING),
                Cell(time if isfinite(standing.milliseconds) else MISSING),
            ]
        )
        failures = comparison.failures.get(standing.tracker, "")
        data.append({**vars(standing), **_ends(standing.interval), "failures": failures})
    few = too_few(comparison)
    notes = (
        [few] if few else ["* marks the best mean and all that no other tracker is better than."]
    )
    notes += [f"{name}: {note}" for name, note in comparison.failures.items()]
    if not all(standing.timed for standing in comparison.standings):
        notes.append(
            "~: time of the accuracy runs, which share the machine (run --timing measures)."
        )
    heads = ["tracker", measure.head, "95 %", "never lost [%]", "ms a frame"]
    return Table(
        name="comparison",
        caption=_caption(comparison),
        heads=["", *heads] if lettered else heads,
        n_labels=2 if lettered else 1,
        rows=rows,
        ranks=[0, 1, 3, 2],
        notes=notes,
        data=pd.DataFrame(data).drop(columns="interval"),
    )


def _caption(comparison: Comparison) -> str:
    text = f"{comparison.measure.head}, {times(comparison)}"
    if comparison.pairs and not too_few(comparison):
        text += f"; {hold_together(comparison)}"
    return f"{text}, {comparison.units.scope}"


def _pair_table(comparison: Comparison) -> Table:
    """Return answers on all pairs."""
    rows, data = [], []
    for pair in comparison.pairs:
        answer = answer_text(comparison, pair)
        if same := same_boxes_text(comparison, pair):
            answer += f"; {same}"
        rows.append(
            [Cell(f"{pair.first} - {pair.second}"), *_cells(comparison, pair), Cell(answer)]
        )
        data.append({**_pair_data(pair), **_ends(pair.interval)})
    margin = f"±{comparison.margin * comparison.measure.scale:g}{unit(comparison)}"
    return Table(
        name="comparison-pairs",
        caption=f"Differences, first minus second: {_caption(comparison)}. Margin {margin}.",
        heads=["pair", _difference_head(comparison), "interval", "better on", "the first is"],
        n_labels=1,
        rows=rows,
        ranks=[1, 1, 2, 0],
        data=pd.DataFrame(data),
    )


def _short_pairs(comparison: Comparison) -> Table:
    """Return answers for a screen: reasons stand in lines of their own."""
    names, pairs, rows = called(comparison), shown_pairs(comparison), []
    for pair in pairs:
        cells = _cells(comparison, pair)
        label = f"{names[pair.first]} - {names[pair.second]}"
        row = [Cell(label), *cells, Cell(pair.answer.label)]
        rows.append(row)
        remarks = [pair.answer.reason, same_boxes_text(comparison, pair)]
        lines = textwrap.wrap("; ".join(filter(None, remarks)), width() - 4)
        rows += [[Cell(f"    {line}"), *[Cell("")] * len(row[1:])] for line in lines]
    others = len(comparison.pairs) - len(pairs)
    return Table(
        name="comparison-pairs",
        caption=f"Differences, first minus second; better on so many {comparison.units.plural}.",
        heads=["pair", _difference_head(comparison), "interval", "better on", "the first is"],
        n_labels=1,
        rows=rows,
        ranks=[1, 1, 2, 0],
        notes=[f"{others} other pairs are in --json and --folder."] if others else [],
    )


def _pair_data(pair: Pair) -> dict[str, Any]:
    return {
        "first": pair.first,
        "second": pair.second,
        "answer": pair.answer.label,
        "reason": pair.answer.reason,
        "difference": pair.difference,
        "better_on": pair.wins,
        "units": len(pair.by_unit),
        "p": pair.answer.p,
        "needed": pair.answer.needed,
        "same_boxes": pair.same_boxes,
    }


def _cells(comparison: Comparison, pair: Pair) -> list[Cell]:
    return [
        Cell(number(comparison, pair.difference, signed=True)),
        Cell(between(comparison, pair.interval, signed=True)),
        Cell(wins_text(pair)),
    ]


def _differences(comparison: Comparison) -> Table:
    """Return the differences of pairs by unit."""
    names, pairs = called(comparison), shown_pairs(comparison)
    columns = [[*pair.by_unit.tolist(), pair.difference] for pair in pairs]
    rows = [
        [Cell(label), *(Cell(number(comparison, value, signed=True)) for value in values)]
        for label, values in zip(
            [*comparison.units.labels, "mean"], zip(*columns, strict=True), strict=True
        )
    ]
    return Table(
        name="comparison-differences",
        caption=f"Differences of {comparison.measure.head} by {comparison.units.kind}.",
        heads=[
            comparison.units.kind,
            *(f"{names[pair.first]} - {names[pair.second]}" for pair in pairs),
        ],
        n_labels=1,
        rows=rows,
        notes=[
            f"{names[pair.first]} - {names[pair.second]}: {same}"
            for pair in pairs
            if (same := same_boxes_text(comparison, pair))
        ],
    )


def _sequences(comparison: Comparison) -> Table:
    """Return means and spread over repetitions of every tracker on every sequence."""
    heads = ["sequence", *comparison.scores]
    rows, data = [], []
    for position, sequence in enumerate(comparison.sequences):
        row = [Cell(sequence)]
        for tracker, by_sequence in comparison.scores.items():
            runs = by_sequence[position]
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
    widest = comparison.measure.most - comparison.measure.least
    rows, data = [], []
    for pair in shown_pairs(comparison):
        for (knob, value), (n, differences) in comparison.by_part(pair).items():
            interval = interval_or_none(differences, 1, -widest, widest)
            mean = float(np.mean(differences))
            rows.append(
                [
                    Cell(f"{pair.first} - {pair.second}"),
                    Cell(f"{knob}={value}"),
                    Cell(str(n)),
                    Cell(number(comparison, mean, signed=True)),
                    Cell(between(comparison, interval, signed=True)),
                ]
            )
            numbers = {"sequences": n, "difference": mean, **_ends(interval)}
            part = {"first": pair.first, "second": pair.second, "knob": knob, "value": value}
            data.append(part | numbers)
    plural = comparison.units.plural
    return Table(
        name="comparison-parts",
        caption=(
            f"Differences of {comparison.measure.head} by parameter and by attribute (of sequences "
            f"in which it occurs), first minus second, on n sequences; 95 % intervals over "
            f"{plural}, each on its own."
        ),
        heads=["pair", "part", "n", _difference_head(comparison), "95 %"],
        n_labels=2,
        rows=rows,
        data=pd.DataFrame(data),
    )


def _difference_head(comparison: Comparison) -> str:
    unit = comparison.measure.unit
    return f"difference [{unit}]" if unit else "difference"


def _ends(interval: Interval | None) -> dict[str, float]:
    low, high = interval if interval is not None else (float("nan"), float("nan"))
    return {"low": low, "high": high}


def _listed(interval: Interval | None) -> list[float] | None:
    return None if interval is None else [*map(float, interval)]


def _or_none(value: float) -> float | None:
    return value if isfinite(value) else None
