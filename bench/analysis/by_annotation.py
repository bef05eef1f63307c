"""Scores over the sequences that have an annotated attribute, such as OTB's `OCC`.

Annotated attributes come with a data set: `attrs.txt` of OTB, tags of VOT, flags of LaSOT. A
sequence belongs to an attribute if the attribute occurs in one of its frames.
"""

from collections.abc import Collection, Mapping
from math import isfinite
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackmark.bench.analysis.by_metrics import MetricScores, metrics_for, table_prefix
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import heading
from trackmark.bench.store.runs import Runs
from trackmark.reports.tables import MISSING, Cell, Table

MIN_AXES = 3
"""Minimum number of attributes of a radar plot."""


class AnnotationReport(NamedTuple):
    """Scores by annotated attribute."""

    table: Table
    quantity: str
    # by tracker, in the order of `headings`; empty if none is finite
    scores: Mapping[str, list[float]]
    headings: list[str]  # attributes with their number of sequences


def annotation_reports(runs: Runs, metrics: Collection[str]) -> list[AnnotationReport]:
    """Return one report per protocol and metrics; none if no attribute is annotated.

    For VOT's metrics the score is the expected average overlap, for other metrics the first score.
    """
    sequences: dict[str, set[str]] = {}
    for sequence, names in runs.attributes.items():
        for name in names:
            sequences.setdefault(name, set()).add(sequence)
    groups = {name: sequences[name] for name in sorted(sequences)}
    return [
        _report(runs, name, groups, protocol)
        for protocol in sorted(runs.protocols)
        for name in metrics_for(list(metrics), protocol)
        if groups
    ]


def _report(
    runs: Runs, metrics: str, groups: Mapping[str, Collection[str]], protocol: str
) -> AnnotationReport:
    columns = find_metrics(metrics).metrics
    score = "eao" if "eao" in columns else next(key for key in columns if columns[key].direction)
    scores = MetricScores(runs, metrics, protocol)
    results = {group: scores.of_group(members) for group, members in groups.items()}
    headings = [f"{group} ({len(members)})" for group, members in groups.items()]
    trackers = list(results[next(iter(groups))])
    values = {name: [results[group][name].scores[score] for group in groups] for name in trackers}
    notes = []
    if not np.isfinite([*values.values()]).any():
        values = {}
        notes = [
            f"The table is empty: no tracker has a finite {heading(score)} on these sequences. See "
            f"`trackmark describe {metrics}` for its definition."
        ]
    quantity = f"{heading(score)} ({metrics})"
    table = Table(
        name=f"{table_prefix(protocol)}annotated-{metrics}",
        caption=f"{quantity} over the sequences with an annotated attribute (number of sequences).",
        headings=["tracker", *headings],
        n_labels=1,
        rows=[
            [Cell(name), *(Cell(f"{x:.3f}" if isfinite(x) else MISSING) for x in row)]
            for name, row in values.items()
        ],
        notes=notes,
        records=pd.DataFrame.from_dict(values, "index", columns=list(groups))
        .rename_axis("tracker")
        .reset_index(),
    )
    return AnnotationReport(table, quantity, values, headings)
