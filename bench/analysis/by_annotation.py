"""Scores over the sequences that have an annotated attribute, such as OTB's `OCC`.

Annotated attributes come with a data set: `attrs.txt` of OTB, tags of VOT, flags of LaSOT. A
sequence belongs to an attribute if the attribute occurs in one of its frames.
"""

from collections.abc import Collection, Mapping
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackmark.bench.analysis.by_metrics import presets_for, scores_by_group, table_prefix
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import heading
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.truth import find_attributes
from trackmark.reports.tables import MISSING, Cell, Table

MIN_AXES = 3
"""Minimum number of attributes of a radar plot."""


class AnnotationReport(NamedTuple):
    """Scores of a preset by annotated attribute."""

    table: Table
    quantity: str
    # by tracker, in the order of `heads`; empty if none is finite
    scores: Mapping[str, list[float]]
    heads: list[str]  # attributes with their number of sequences


def annotation_reports(experiment: Path, presets: Collection[str]) -> list[AnnotationReport]:
    """Return one report per protocol and preset; none if no attribute is annotated.

    For VOT's presets the score is the expected average overlap, for other presets the first score.
    """
    runs = load_runs(experiment)
    ended = runs[runs["status"].isin(["finished", "failed"])]
    sequences: dict[str, set[str]] = {}
    for sequence, names in find_attributes(experiment, ended).items():
        for name in names:
            sequences.setdefault(name, set()).add(sequence)
    groups = {name: sequences[name] for name in sorted(sequences)}
    return [
        _report(experiment, preset, runs, groups, stored)
        for stored in sorted(set(map(str, runs["protocol"].unique())) - {TIMING})
        for preset in presets_for(list(presets), stored)
        if groups
    ]


def _report(
    experiment: Path,
    preset: str,
    runs: pd.DataFrame,
    groups: Mapping[str, Collection[str]],
    stored: str,
) -> AnnotationReport:
    columns = metrics_preset(preset).columns
    score = "eao" if "eao" in columns else next(key for key in columns if columns[key].better)
    results = scores_by_group(experiment, preset, runs, groups, stored)
    heads = [f"{group} ({len(members)})" for group, members in groups.items()]
    trackers = list(results[next(iter(groups))])
    values = {name: [results[group][name].scores[score] for group in groups] for name in trackers}
    notes = []
    if not np.isfinite([*values.values()]).any():
        values = {}
        notes = [
            f"The table is empty: no tracker has a finite {heading(score)} on these sequences. See "
            f"`trackmark describe {preset}` for its definition."
        ]
    quantity = f"{heading(score)} ({preset})"
    table = Table(
        name=f"{table_prefix(stored)}annotated-{preset}",
        caption=f"{quantity} over the sequences with an annotated attribute (number of sequences).",
        heads=["tracker", *heads],
        n_labels=1,
        rows=[
            [Cell(name), *(Cell(f"{x:.3f}" if isfinite(x) else MISSING) for x in row)]
            for name, row in values.items()
        ],
        notes=notes,
        data=pd.DataFrame.from_dict(values, "index", columns=list(groups))
        .rename_axis("tracker")
        .reset_index(),
    )
    return AnnotationReport(table, quantity, values, heads)
