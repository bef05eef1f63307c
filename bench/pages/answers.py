"""Sections of a page on which tracker is better, in all and on parts of the sequences."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.comparing import MARGINS
from bench.comparing.comparison import Comparison, ComparisonError, compare, parts_of
from bench.comparing.tables import files as comparison_tables
from bench.comparing.words import paragraph
from bench.pages.takes import Reading
from bench.protocols import STORED_ONCE
from bench.reporting.doubt import bounded_score
from bench.reporting.tables import SUMMARY
from reports.page.content import Place, Section, Sheet
from reports.tables import MISSING, Cell, Table

__all__ = ["answers", "parts", "repetitions"]

_NO_PARTS = (
    "These sequences have no parts to compare trackers on: names of none say a knob that others "
    "turn otherwise (as plain/target:noise=30 does), and no attribute is known of some that others "
    "lack. Parameters of trackers are rows of their own in every table."
)


def answers(
    runs: pd.DataFrame, occurring: Mapping[str, set[str]], reading: Reading, command: str
) -> tuple[Section, list[Sheet]]:
    """Which tracker is better, or why that can't be said; and by how much on which parts.

    `occurring`: attributes of sequences by name. `command`: that makes it again.
    """
    title, measure = "Which is better", SUMMARY[0]
    if not (runs["protocol"] == STORED_ONCE).any():
        return Section("answers", title, ["No comparison: nothing was run in one pass."]), []
    try:
        found = compare(runs, measure, MARGINS[measure.name], attributes=occurring)
    except ComparisonError as error:
        return Section("answers", title, [f"No comparison: {error}"], command=command), []
    sheets = {}
    for table in comparison_tables(found):
        columns = len(table.heads) - table.n_labels
        rows = table.data.to_dict("records")
        if table.name != "comparison-sequences":
            places = [[_told_by(row, found, reading)] * columns for row in rows]
            sheets[table.name] = Sheet(table, places=places)
    differences = [sheets.pop(name) for name in list(sheets) if name == "comparison-parts"]
    words = [paragraph(found)]
    return Section("answers", title, words, list(sheets.values()), command=command), differences


def _told_by(row: Mapping[Any, Any], found: Comparison, reading: Reading) -> Place | None:
    """What a row of a comparison opens: of a pair the sequence on which they differ most.

    Of a part of the sequences one of these.
    """
    if "first" not in row:
        return reading.place(str(row["tracker"]), None, "overlap")
    parts = parts_of(found.sequences, found.attributes) if "knob" in row else {}
    here = parts.get((row.get("knob", ""), row.get("value", "")), True)
    for pair in found.pairs:
        if {pair.first, pair.second} == {row["first"], row["second"]}:
            position = int(np.argmax(np.where(here, np.abs(pair.differences), -1.0)))
            ahead = pair.differences[position] > 0
            behind = pair.second if ahead else pair.first
            return reading.place(behind, found.sequences[position], "overlap")
    return None


def parts(
    scored: pd.DataFrame,
    occurring: Mapping[str, set[str]],
    reading: Reading,
    differences: Sequence[Sheet],
) -> Section:
    """Mean overlap on the sequences that have a knob's value, or an attribute."""
    if "mean_overlap" not in scored or not reading.trackers:
        return Section("parts", "")  # no run finished
    sequences = [stage.name for stage in reading.stages]
    masks = parts_of(sequences, [occurring.get(name, ()) for name in sequences])
    by = scored.groupby(["tracker", "sequence"], observed=True)["mean_overlap"]
    means = by.mean().where(by.count() == by.size())
    rows, values, places = [], list[list[float]](), []
    data: list[dict[str, Any]] = []
    for (knob, value), chosen in masks.items():
        here = [name for name, taken in zip(sequences, chosen, strict=True) if taken]
        cells = []
        for name in reading.trackers:
            found = means.get(name, pd.Series(dtype=float)).reindex(here).to_numpy(float)
            mean, low, high = _with_interval(found)
            cells.append(f"{mean:.3f}" if np.isfinite(mean) else MISSING)
            cells[-1] += f" [{low:.3f}, {high:.3f}]" if np.isfinite(low) else ""
            told = {"knob": knob, "value": value, "sequences": len(here), "tracker": name}
            data.append({**told, "measure": "mean_overlap", "mean": mean, "low": low, "high": high})
        rows.append([f"{knob}={value}", str(len(here)), *cells])
        values.append([len(here), *(one["mean"] for one in data[-len(reading.trackers) :])])
        worst = [
            reading.worst_of([(name, one) for one in here], "overlap") for name in reading.trackers
        ]
        places.append([None, *worst])
    table = Table(
        "parts",
        "Mean overlap (from 0 to 1) by knob and by attribute (of sequences in which it occurs): "
        f"means over n sequences, each counting once, of {repetitions(scored)} each. In brackets "
        "the 95 % interval for new sequences like these, none of one sequence.",
        ["part", "n", *reading.trackers],
        1,
        [[Cell(text) for text in row] for row in rows],
        data=pd.DataFrame(data),
    )
    title = "By knob and attribute"
    if not rows:
        return Section("parts", title, [_NO_PARTS] if len(sequences) > 1 else [])
    return Section("parts", title, sheets=[Sheet(table, values, places), *differences])


def repetitions(scored: pd.DataFrame) -> str:
    """How often trackers were run on each sequence: `1 to 3 repetitions`."""
    counts = scored.groupby(["tracker", "sequence"], observed=True).size()
    fewest, most = counts.min(), counts.max()
    times = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"{times} repetition{'s' if most > 1 else ''}"


def _with_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """A mean and its interval, NaN where there is none."""
    if not len(values) or not np.isfinite(values).all():
        return np.nan, np.nan, np.nan
    low, high = bounded_score(SUMMARY[0], values) if len(values) > 1 else (np.nan, np.nan)
    return float(values.mean()), low, high
