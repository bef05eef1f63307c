"""Scores of runs before and after their replacement, for example of a changed tracker."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.reporting.tables import MASKS, PRESET, SUMMARY, TIMES
from trackmark.bench.store.data_frames import to_data_frame
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.reports.renderers import terminal_lines
from trackmark.reports.tables import Cell, Table, summary_table

Rows: TypeAlias = Sequence[Mapping[str, Any]]


class ReplacedRuns:
    """Stored runs that a plan replaces.

    `plan`: plan with the states before execution. `rows`: rows of the stored runs at that time.
    """

    def __init__(self, plan: Plan, rows: Rows) -> None:
        self._rows = rows
        self._stale = {cell for cell in plan.requested if plan.state(cell) == State.STALE}

    def before(self, caption: str) -> str:
        """Return the means of the old scores as text."""
        stages = {"before": _select(self._rows, self._stale)}
        return "\n".join(terminal_lines(_table(stages, caption)))

    def compared(self, now: Plan, rows: Rows) -> str:
        """Return the means of old and new scores of replaced runs as text; empty if there are none.

        `now`: plan with the present states. `rows`: rows of the runs stored now.
        """
        replaced = {cell for cell in self._stale if now.state(cell) != State.STALE}
        if not replaced:
            return ""
        stages = {"before": _select(self._rows, replaced), "after": _select(rows, replaced)}
        runs = "1 run" if len(replaced) == 1 else f"{len(replaced)} runs"
        table = _table(stages, f"Scores before and after the replacement of {runs}:")
        # `before` printed the notes on the old runs; the table of the new runs has its own notes.
        return "\n".join(terminal_lines(replace(table, notes=[])))


def _select(rows: Rows, cells: Collection[RunKey]) -> Rows:
    return [row for row in rows if run_key(row) in cells]


def _table(stages: Mapping[str, Rows], caption: str) -> Table:
    """Return a table with each tracker before and after, over its replaced runs."""
    runs = to_data_frame({**row, "stage": stage} for stage, rows in stages.items() for row in rows)
    masks = [m for m in MASKS if m.name in runs and runs[m.name].notna().any()]
    # Some runs lack scores: for example, supervised runs have no one-pass scores.
    runs = runs.assign(**{m.name: np.nan for m in SUMMARY if m.name not in runs})
    measures = TIMES if (runs["protocol"] == "timing").any() else (*SUMMARY, *masks)
    parts: list[Table] = []
    rows: list[list[Cell]] = []
    for name, tracker_runs in runs.groupby("tracker", sort=False, observed=True):
        labelled = tracker_runs.assign(
            tracker=[f"{name}, {stage}" for stage in tracker_runs["stage"]]
        )
        parts.append(summary_table(labelled, measures, "", PRESET))
        rows += [
            [Cell(str(name)), Cell(str(stage)), *row[1:]]
            for stage, row in zip(tracker_runs["stage"].unique(), parts[-1].rows, strict=True)
        ]
    return replace(
        parts[0],
        caption=caption,
        heads=["tracker", "runs", *parts[0].heads[1:]],
        n_labels=2,
        rows=rows,
        notes=[note for part in parts for note in part.notes],
    )
