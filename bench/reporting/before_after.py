"""Scores of runs before and after they are replaced, for example of a changed tracker."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.reporting.tables import MASKS, PRESET, SUMMARY, TIMES
from trackmark.bench.store.data_frames import to_data_frame
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.reports.renderers import to_text
from trackmark.reports.table_width import on_terminal
from trackmark.reports.tables import Cell, Table, summary_table

Rows: TypeAlias = Sequence[Mapping[str, Any]]


class Replaced:
    """Stored runs that a plan replaces.

    `plan`: with the states before anything was run. `rows`: of stored runs at that time.
    """

    def __init__(self, plan: Plan, rows: Rows) -> None:
        self._rows = rows
        self._stale = {cell for cell in plan.requested if plan.state(cell) == State.STALE}

    def before(self, caption: str) -> str:
        """Return means of their scores as text."""
        stages = {"before": _chosen(self._rows, self._stale)}
        return on_terminal(_table(stages, caption), to_text)

    def compared(self, now: Plan, rows: Rows) -> str:
        """Return mean scores before and after, of runs that are replaced by now; '' for none.

        `now`: the plan with the states by now. `rows`: of stored runs now.
        """
        gone = {cell for cell in self._stale if now.state(cell) != State.STALE}
        if not gone:
            return ""
        stages = {"before": _chosen(self._rows, gone), "after": _chosen(rows, gone)}
        runs = "1 run that was" if len(gone) == 1 else f"{len(gone)} runs that were"
        table = _table(stages, f"What became of the scores of {runs} replaced:")
        # The notes were printed before; those of the new runs follow in their own table.
        return on_terminal(replace(table, notes=[]), to_text)


def _chosen(rows: Rows, cells: Collection[RunKey]) -> Rows:
    return [row for row in rows if run_key(row) in cells]


def _table(stages: Mapping[str, Rows], caption: str) -> Table:
    """Return trackers before and after, each over its own replaced runs."""
    runs = to_data_frame({**row, "stage": stage} for stage, rows in stages.items() for row in rows)
    masks = [one for one in MASKS if one.name in runs and runs[one.name].notna().any()]
    missing = [
        one.name for one in SUMMARY if one.name not in runs
    ]  # for example of supervised runs
    runs = runs.assign(**dict.fromkeys(missing, np.nan))
    measures = TIMES if (runs["protocol"] == "timing").any() else (*SUMMARY, *masks)
    parts: list[Table] = []
    rows: list[list[Cell]] = []
    for name, its in runs.groupby("tracker", sort=False, observed=True):
        labelled = its.assign(tracker=[f"{name}, {stage}" for stage in its["stage"]])
        parts.append(summary_table(labelled, measures, "", PRESET))
        rows += [
            [Cell(str(name)), Cell(str(stage)), *row[1:]]
            for stage, row in zip(its["stage"].unique(), parts[-1].rows, strict=True)
        ]
    return replace(
        parts[0],
        caption=caption,
        heads=["tracker", "runs", *parts[0].heads[1:]],
        n_labels=2,
        rows=rows,
        notes=[note for part in parts for note in part.notes],
    )
