"""Scores of runs before and after they are replaced, for example of a changed tracker."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.reporting.tables import MASKS, PRESET, SUMMARY, TIMES
from trackmark.bench.store.columns import coded
from trackmark.reports.renderers import to_text
from trackmark.reports.table_width import on_terminal
from trackmark.reports.tables import Cell, Table, summary_table


class Replaced:
    """Stored runs that a plan replaces.

    `plan`: with the states before anything was run. `index`: as it was then.
    """

    def __init__(self, plan: Plan, index: pa.Table) -> None:
        self._plan, self._index = plan, index
        self._stale = plan.states.ravel() == State.STALE

    def before(self, caption: str) -> str:
        """Return means of their scores as text."""
        stages = {"before": self._rows(self._index, self._stale)}
        return on_terminal(_table(stages, caption), to_text)

    def compared(self, now: Plan, index: pa.Table) -> str:
        """Return mean scores before and after, of runs that are replaced by now; '' for none.

        `now`: the plan with the states by now. `index`: as it is now.
        """
        gone = self._stale & (now.states.ravel() != State.STALE)
        if not gone.any():
            return ""
        stages = {"before": self._rows(self._index, gone), "after": self._rows(index, gone)}
        runs = "1 run that was" if gone.sum() == 1 else f"{gone.sum()} runs that were"
        table = _table(stages, f"What became of the scores of {runs} replaced:")
        # The notes were printed before; those of the new runs follow in their own table.
        return on_terminal(replace(table, notes=[]), to_text)

    def _rows(self, index: pa.Table, chosen: NDArray[np.bool_]) -> pa.Table:
        runs = self._plan.runs(index)
        return index.filter(pa.array((runs >= 0) & chosen[runs]))


def _table(stages: dict[str, pa.Table], caption: str) -> Table:
    """Return trackers before and after, each over its own replaced runs."""
    tables = [
        rows.append_column("stage", coded([stage], np.zeros(len(rows))))
        for stage, rows in stages.items()
    ]
    runs = pa.concat_tables(tables, promote_options="default").unify_dictionaries().to_pandas()
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
