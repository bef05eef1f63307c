"""What becomes of the scores of runs that are replaced, as by a changed tracker's."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.reporting.tables import MASKS, PRESET, SUMMARY, TIMES
from trackmark.bench.store.layout import Cell as RunCell
from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.loading import as_frame
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
        self._stale = {cell for cell in plan.cells if plan.state(cell) == State.STALE}

    def before(self, caption: str) -> str:
        """Means of their scores, as text."""
        stages = {"before": _chosen(self._rows, self._stale)}
        return on_terminal(_table(stages, caption), to_text)

    def compared(self, now: Plan, rows: Rows) -> str:
        """Means of the scores before and after, of those that are replaced by now; '' for none.

        `now`: the plan with the states by now. `rows`: of stored runs now.
        """
        gone = {cell for cell in self._stale if now.state(cell) != State.STALE}
        if not gone:
            return ""
        stages = {"before": _chosen(self._rows, gone), "after": _chosen(rows, gone)}
        runs = "1 run that was" if len(gone) == 1 else f"{len(gone)} runs that were"
        table = _table(stages, f"What became of the scores of {runs} replaced:")
        # Notes on the runs of before were told with them, those of now stand in their own table.
        return on_terminal(replace(table, notes=[]), to_text)


def _chosen(rows: Rows, cells: Collection[RunCell]) -> Rows:
    return [row for row in rows if cell_of(row) in cells]


def _table(stages: Mapping[str, Rows], caption: str) -> Table:
    """Return trackers before and after; not all of their runs may have been replaced."""
    runs = as_frame({**row, "stage": stage} for stage, rows in stages.items() for row in rows)
    masks = [one for one in MASKS if one.name in runs and runs[one.name].notna().any()]
    lacking = [one.name for one in SUMMARY if one.name not in runs]  # of runs begun again, say
    runs = runs.assign(**dict.fromkeys(lacking, np.nan))
    measures = TIMES if (runs["protocol"] == "timing").any() else (*SUMMARY, *masks)
    parts: list[Table] = []
    rows: list[list[Cell]] = []
    for name, its in runs.groupby("tracker", sort=False, observed=True):
        labelled = its.assign(tracker=[f"{name}, {stage}" for stage in its["stage"]])
        parts.append(summary_table(labelled, measures, "", PRESET))
        rows += [
            [Cell(str(name)), Cell(row[0].text.rpartition(" ")[2]), *row[1:]]
            for row in parts[-1].rows
        ]
    return replace(
        parts[0],
        caption=caption,
        heads=["tracker", "runs", *parts[0].heads[1:]],
        n_labels=2,
        rows=rows,
        notes=[note for part in parts for note in part.notes],
    )
