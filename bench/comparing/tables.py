"""A comparison as tables and as JSON."""

import json
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from math import isfinite, nan
from typing import Any

import pandas as pd

from trackmark.bench.comparing.comparison import Comparison, Pair, means_in_part, parts_of
from trackmark.bench.comparing.summary_text import (
    answer_text,
    between,
    margin_text,
    number,
    paragraph,
    same_boxes_text,
    shown_pairs,
    times,
    too_few,
    wins_text,
)
from trackmark.bench.statistics.rules import interval_or_none
from trackmark.reports.printable import width
from trackmark.reports.tables import MISSING, Cell, Table

LONGEST_PAIR = 44
"""Letters of a pair's names; longer ones get a line of their own on a screen."""


def screen(comparison: Comparison) -> list[Table]:
    """Return tables for a terminal: standings and pairs.

    With too few units for intervals, differences by unit replace the answers on pairs.
    """
    if not comparison.pairs:
        return [_standings(comparison)]
    few = too_few(comparison)
    pairs = _differences(comparison) if few else _pair_table(comparison, on_screen=True)
    return [_standings(comparison), pairs]


def files(comparison: Comparison) -> list[Table]:
    """Return all tables, for a folder: also scores by sequence, and differences by part."""
    pairs = [_pair_table(comparison)] if comparison.pairs else []
    parts = _parts(comparison)
    tables = [_standings(comparison), *pairs, _sequences(comparison)]
    return [*tables, parts] if parts.rows else tables


def as_data(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison for `--json`; scores unscaled, gaps null."""
    units = comparison.units
    return {
        "measure": comparison.measure.name,
        "title": comparison.measure.title,
        "direction": comparison.measure.direction,
        "margin": comparison.measure.margin,
        "unit": units.kind,
        "units": list(units.labels),
        "scope": units.scope,
        "sequences": list(comparison.sequences),
        "repetitions": list(comparison.repetitions),
        "comparisons": len(comparison.pairs),
        "trackers": [
            _without_gaps(vars(standing))
            | {
                "failures": comparison.failures.get(standing.tracker),
                "repeatable": standing.tracker not in comparison.not_repeatable,
            }
            for standing in comparison.standings
        ],
        "left_out": {name: comparison.failures[name] for name in comparison.left_out},
        "pairs": [
            _without_gaps(_pair_data(pair))
            | {
                "interval": pair.interval,
                "differences": pair.differences.tolist(),
                "unit_differences": pair.by_unit.tolist(),
            }
            for pair in comparison.pairs
        ],
        "parts": json.loads(_parts(comparison).data.to_json(orient="records")),
        "paragraph": paragraph(comparison),
    }


def _standings(comparison: Comparison) -> Table:
    """Return means of the trackers."""
    rows, data = [], []
    for standing in comparison.standings:
        time = f"{'' if standing.timed else '~'}{standing.milliseconds:.3g}"
        remark = " (not repeatable)" * (standing.tracker in comparison.not_repeatable)
        rows.append(
            [
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
    notes = [
        few or "* marks the best mean and all that no other tracker is better than, over all pairs."
    ]
    notes += [f"{name}: {note}" for name, note in comparison.failures.items()]
    if not all(standing.timed for standing in comparison.standings):
        notes.append(
            "~: time of the accuracy runs, which share the machine (run --timing measures)."
        )
    return Table(
        name="comparison",
        caption=_caption(comparison),
        heads=["tracker", comparison.measure.head, "95 %", "never lost [%]", "ms a frame"],
        n_labels=1,
        rows=rows,
        ranks=[0, 1, 3, 2],
        notes=notes,
        data=pd.DataFrame(data).drop(columns="interval"),
    )


def _caption(comparison: Comparison) -> str:
    text, m = f"{comparison.measure.head}, {times(comparison)}", len(comparison.pairs)
    if m and not too_few(comparison):
        intervals = "interval holds" if m == 1 else f"{m} intervals hold together"
        text += f"; the {intervals} at 95 %"
    return f"{text}, {comparison.units.scope}"


def _pair_table(comparison: Comparison, *, on_screen: bool = False) -> Table:
    """Return answers on pairs; on a screen, reasons and long names have lines of their own."""
    caption = f": {_caption(comparison)}. Margin {margin_text(comparison)}."
    if on_screen:
        caption = f"; better on so many {comparison.units.plural}."
    pairs, rows = shown_pairs(comparison) if on_screen else comparison.pairs, []
    for pair in pairs:
        same = same_boxes_text(comparison, pair)
        numbers = [*_texts(comparison, pair.difference, pair.interval), wins_text(pair)]
        if on_screen:
            reasons = "; ".join(filter(None, [pair.answer.reason, same]))
            rows += _pair_on_screen(pair.label, [*numbers, pair.answer.label], reasons)
        else:
            answer = "; ".join(filter(None, [answer_text(pair), same]))
            rows.append([pair.label, *numbers, answer])
    others = len(comparison.pairs) - len(pairs)
    return Table(
        name="comparison-pairs",
        caption=f"Differences, first minus second{caption}",
        heads=["pair", _difference_head(comparison), "interval", "better on", "the first is"],
        n_labels=1,
        rows=_cells(rows),
        ranks=[1, 1, 2, 0],
        notes=[f"{others} other pairs are in --json and --folder."] if others else [],
        data=pd.DataFrame(_pair_data(pair) | _ends(pair.interval) for pair in pairs),
    )


def _pair_on_screen(label: str, texts: list[str], reasons: str) -> list[list[str]]:
    empty = [""] * len(texts)
    names = textwrap.wrap(label, width(), break_on_hyphens=False)
    above = [[line, *empty] for line in names] if len(label) > LONGEST_PAIR else []
    below = [[f"    {line}", *empty] for line in textwrap.wrap(reasons, width() - 4)]
    return [*above, ["" if above else label, *texts], *below]


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


def _differences(comparison: Comparison) -> Table:
    """Return the differences of pairs by unit; pairs with long names are numbered."""
    pairs, kind = shown_pairs(comparison), comparison.units.kind
    labels, notes = [pair.label for pair in pairs], []
    if max(map(len, labels)) > LONGEST_PAIR:
        notes = [f"pair {n}: {label}" for n, label in enumerate(labels, 1)]
        labels = [f"pair {n}" for n in range(1, len(pairs) + 1)]
    remarks = [same_boxes_text(comparison, pair) for pair in pairs]
    notes += [f"{label}: {same}" for label, same in zip(labels, remarks, strict=True) if same]
    columns = [[*pair.by_unit.tolist(), pair.difference] for pair in pairs]
    rows = [
        [unit, *(number(comparison, value, signed=True) for value in values)]
        for unit, *values in zip([*comparison.units.labels, "mean"], *columns, strict=True)
    ]
    return Table(
        name="comparison-differences",
        caption=f"Differences of {comparison.measure.head} by {kind}.",
        heads=[kind, *labels],
        n_labels=1,
        rows=_cells(rows),
        notes=notes,
    )


def _sequences(comparison: Comparison) -> Table:
    """Return means and spread over repetitions of every tracker on every sequence."""
    rows, data = [], []
    for position, sequence in enumerate(comparison.sequences):
        row = [sequence]
        for tracker, by_sequence in comparison.scores.items():
            runs = by_sequence[position]
            mean, spread = float(runs.mean()), float(runs.std(ddof=1)) if len(runs) > 1 else nan
            text = f" ±{number(comparison, spread)}" if isfinite(spread) else ""
            row.append(f"{number(comparison, mean)}{text}")
            numbers = {"mean": mean, "standard_deviation": spread, "runs": len(runs)}
            data.append({"sequence": sequence, "tracker": tracker, **numbers})
        rows.append(row)
    return Table(
        name="comparison-sequences",
        caption=f"{comparison.measure.head} by sequence, ± standard deviation over repetitions.",
        heads=["sequence", *comparison.scores],
        n_labels=1,
        rows=_cells(rows),
        data=pd.DataFrame(data),
    )


def _parts(comparison: Comparison) -> Table:
    rows, data = [], []
    widest = comparison.measure.most - comparison.measure.least
    parts = parts_of(comparison.sequences, comparison.attributes)
    for pair, ((knob, value), chosen) in product(shown_pairs(comparison), parts.items()):
        n, by_unit = int(chosen.sum()), means_in_part(comparison.units, pair.differences, chosen)
        mean, interval = float(by_unit.mean()), interval_or_none(by_unit, 1, -widest, widest)
        rows.append([pair.label, f"{knob}={value}", str(n), *_texts(comparison, mean, interval)])
        numbers = {"sequences": n, "difference": mean, **_ends(interval)}
        part = {"first": pair.first, "second": pair.second, "knob": knob, "value": value}
        data.append(part | numbers)
    return Table(
        name="comparison-parts",
        caption=(
            f"Differences of {comparison.measure.head} by parameter and by attribute (of sequences "
            f"in which it occurs), first minus second, on n sequences; 95 % intervals over "
            f"{comparison.units.plural}, each on its own."
        ),
        heads=["pair", "part", "n", _difference_head(comparison), "95 %"],
        n_labels=2,
        rows=_cells(rows),
        data=pd.DataFrame(data),
    )


def _cells(rows: Iterable[Sequence[str]]) -> list[list[Cell]]:
    return [[Cell(text) for text in row] for row in rows]


def _texts(
    comparison: Comparison, difference: float, interval: tuple[float, float] | None
) -> list[str]:
    around = between(comparison, interval, signed=True)
    return [number(comparison, difference, signed=True), around]


def _difference_head(comparison: Comparison) -> str:
    return replace(comparison.measure, title="difference").head


def _ends(interval: tuple[float, float] | None) -> dict[str, float]:
    low, high = interval or (nan, nan)
    return {"low": low, "high": high}


def _without_gaps(row: dict[str, Any]) -> dict[str, Any]:
    """Return the row for JSON, which has no NaN and no infinity."""
    return {
        key: None if isinstance(value, float) and not isfinite(value) else value
        for key, value in row.items()
    }
