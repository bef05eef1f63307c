"""Table of a page with mean overlaps on subsets of the sequences."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from trackmark.bench.analysis.comparison import means_of_subset, subsets_of
from trackmark.bench.pages.content import PageTable
from trackmark.bench.pages.player_runs import PageRuns
from trackmark.bench.statistics.rules import interval_or_none
from trackmark.bench.statistics.units import units_of
from trackmark.reports.tables import MISSING, text_table


def subset_table(
    scored: pd.DataFrame, occurring: Mapping[str, set[str]], runs: PageRuns
) -> PageTable | None:
    """Return mean overlaps by parameter value and attribute of the sequences; None without any."""
    if "mean_overlap" not in scored or not runs.trackers:
        return None  # no finished run
    sequences = [sequence_runs.name for sequence_runs in runs.sequences]
    units = units_of(sequences)
    masks = subsets_of(sequences, [occurring.get(name, ()) for name in sequences])
    shared = {parameter for (parameter, _), mask in masks.items() if mask.sum() > 1}
    groups = scored.groupby(["tracker", "sequence"])["mean_overlap"]
    means = groups.mean().where(groups.count() == groups.size())
    rows, positions, has_intervals = [], [], False
    for (parameter, value), mask in masks.items():
        if parameter not in shared:
            continue
        members = [name for name, is_member in zip(sequences, mask, strict=True) if is_member]
        cells = [f"{parameter}={value}", str(len(members))]
        for name in runs.trackers:
            by_sequence = means.get(name, pd.Series(dtype=float)).reindex(sequences)
            by_unit = means_of_subset(units, by_sequence.to_numpy(float), mask)
            mean = float(by_unit.mean()) if len(by_unit) else np.nan
            limits = interval_or_none(by_unit, 1, 0.0, 1.0) if np.isfinite(mean) else None
            mean_text = f"{mean:.3f}" if np.isfinite(mean) else MISSING
            cells.append(f"{mean_text} [{limits[0]:.3f}, {limits[1]:.3f}]" if limits else mean_text)
            has_intervals |= limits is not None
        rows.append(cells)
        worst = [runs.worst_position_on(name, members, "overlap") for name in runs.trackers]
        positions.append([None, *worst])
    if not rows:
        return None
    caption = (
        "Mean overlap by parameter value and by attribute (of sequences in which it occurs), over "
        "n sequences."
    )
    caption += f" In brackets the 95 % interval {units.scope}." if has_intervals else ""
    table = text_table("subsets", caption, ["subset", "n", *runs.trackers], rows)
    return PageTable(table, positions)
