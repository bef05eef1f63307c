"""Sections of a page that compare trackers on all sequences and on subsets."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.comparing.comparison import Comparison, means_in_part, parts_of
from trackmark.bench.comparing.tables import files as comparison_tables
from trackmark.bench.comparing.tables import paragraph
from trackmark.bench.pages.cards import pair_matrix
from trackmark.bench.pages.player_runs import PageRuns
from trackmark.bench.statistics.rules import interval_or_none
from trackmark.bench.statistics.units import StatisticalUnits, units_of
from trackmark.reports.page.content import PageSection, PageTable
from trackmark.reports.tables import MISSING, text_table


def comparison_section(
    comparison: Comparison, runs: PageRuns, note: str
) -> tuple[PageSection, list[PageTable]]:
    """Return the section that compares trackers, and tables of subsets of the sequences.

    `note`: limit of the answers, if any.
    """
    tables = {table.name: PageTable(table) for table in comparison_tables(comparison)}
    sheets = [tables[name] for name in ("comparison", "comparison-pairs") if name in tables]
    parts = [tables[name] for name in ("comparison-parts",) if name in tables]
    blocks = [pair_matrix(comparison, runs, note)] if comparison.pairs else []
    options: dict[str, Any] = {"blocks": blocks, "hidden": not blocks, "nav": "Comparison"}
    words = [paragraph(comparison)]
    return PageSection("answers", "Who beats whom", words, sheets, **options), parts


def parts_section(
    scored: pd.DataFrame,
    occurring: Mapping[str, set[str]],
    runs: PageRuns,
    differences: Sequence[PageTable],
) -> PageSection:
    """Return the section with mean overlaps by parameter value and attribute of the sequences."""
    if "mean_overlap" not in scored or not runs.trackers:
        return PageSection("parts", "")  # no finished run
    sequences = [stage.name for stage in runs.stages]
    units = units_of(sequences)
    masks = parts_of(sequences, [occurring.get(name, ()) for name in sequences])
    shared = {parameter for (parameter, _), mask in masks.items() if mask.sum() > 1}
    masks = {part: mask for part, mask in masks.items() if part[0] in shared}
    groups = scored.groupby(["tracker", "sequence"], observed=True)["mean_overlap"]
    means = groups.mean().where(groups.count() == groups.size())
    rows, values, places = [], list[list[float]](), []
    data: list[dict[str, Any]] = []
    for (parameter, value), mask in masks.items():
        members = [name for name, is_member in zip(sequences, mask, strict=True) if is_member]
        cells = [f"{parameter}={value}", str(len(members))]
        for name in runs.trackers:
            by_sequence = means.get(name, pd.Series(dtype=float)).reindex(sequences)
            mean, low, high = _with_interval(units, by_sequence.to_numpy(float), mask)
            text = f"{mean:.3f}" if np.isfinite(mean) else MISSING
            cells.append(f"{text} [{low:.3f}, {high:.3f}]" if np.isfinite(low) else text)
            labels = {"knob": parameter, "value": value, "sequences": len(members), "tracker": name}
            scores = {"measure": "mean_overlap", "mean": mean, "low": low, "high": high}
            data.append(labels | scores)
        rows.append(cells)
        values.append([len(members), *(row["mean"] for row in data[-len(runs.trackers) :])])
        places.append([None, *(runs.worst_of(name, members, "overlap") for name in runs.trackers)])
    has_intervals = any(np.isfinite(row["low"]) for row in data)
    caption = (
        "Mean overlap by parameter value and by attribute (of sequences in which it occurs), "
        f"over n sequences of {repetition_text(scored)} each"
        + (f". In brackets the 95 % interval {units.scope}." if has_intervals else ".")
    )
    table = text_table("parts", caption, ["part", "n", *runs.trackers], rows)
    sheet = PageTable(replace(table, data=pd.DataFrame(data)), values, places)
    sheets = [sheet, *differences] if rows else []
    title = "By parameter and attribute"
    return PageSection("parts", title, sheets=sheets, blocks=sheets[:1], hidden=not rows)


def repetition_text(scored: pd.DataFrame) -> str:
    """Return the number of repetitions per sequence as text: `1 to 3 repetitions`."""
    counts = scored.groupby(["tracker", "sequence"], observed=True).size()
    fewest, most = counts.min(), counts.max()
    times = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"{times} repetition{'s' if most > 1 else ''}"


def _with_interval(
    units: StatisticalUnits, by_sequence: NDArray[np.float64], mask: NDArray[np.bool_]
) -> tuple[float, float, float]:
    """Return the mean over the units of a subset and its interval; NaN if undefined."""
    values = means_in_part(units, by_sequence, mask)
    if not len(values) or not np.isfinite(values).all():
        return np.nan, np.nan, np.nan
    low, high = interval_or_none(values, 1, 0.0, 1.0) or (np.nan, np.nan)
    return float(values.mean()), low, high
