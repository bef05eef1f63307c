"""Stored runs of a paper's experiments, and their measures by scene.

`Context` passes the runs, the paper and the report's folder to tables and figures.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import isnan, nan
from pathlib import Path
from typing import Any

import pandas as pd

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import ReproductionOptions
from trackmark.bench.papers.cases import Case, PaperSequence, PaperTracker
from trackmark.bench.papers.measures import FrameRules, Measure, MeasuredRun
from trackmark.bench.papers.paper import Paper
from trackmark.bench.store.database import ResultsError, RunKey, run_key
from trackmark.bench.store.runs import Runs, RunWithTruth


class PaperRuns:
    """Stored runs of a paper.

    Its experiments are folders in `results_root`, and `requested` gives the run keys of each.
    Reading raises `ResultsError` if one of these runs is missing or stale, because the report
    would then mix versions.
    """

    def __init__(
        self, results_root: Path, requested: Mapping[str, Collection[RunKey]], rules: FrameRules
    ) -> None:
        self._results_root, self._requested, self._rules = results_root, requested, rules
        self.stored_run = cache(self._stored_run)
        self.measured_run = cache(self._measured_run)
        # Parsing reads the metadata of all installed packages: about 20 ms.
        self._label = cache(lambda tracker: parse_tracker(tracker).label)

    @cached_property
    def _rows(self) -> dict[tuple[str, str], tuple[Runs, Mapping[str, Any]]]:
        """Row of each run and the runs of its experiment, by tracker and sequence."""
        rows: dict[tuple[str, str], tuple[Runs, Mapping[str, Any]]] = {}
        for experiment, keys in self._requested.items():
            runs, requested_keys = Runs.open(self._results_root / experiment), set(keys)
            runs = runs.select(keys)
            requested = [row for row in runs.rows if run_key(row) in requested_keys]
            unusable = [row for row in requested if row["status"] not in ("finished", "failed")]
            if unusable:
                first = unusable[0]
                raise ResultsError(
                    f"{runs.folder}: {len(unusable)} of {len(requested)} runs are "
                    f"{first['status']}; the first is {first['tracker']} on {first['sequence']}. "
                    "Run `trackmark reproduce` again."
                )
            for row in requested:
                rows.setdefault((row["tracker"], row["sequence"]), (runs, row))
        return rows

    def _stored_run(self, tracker: str, sequence: str) -> RunWithTruth | None:
        """Return the run of a tracker on a sequence (both specifications); None without one."""
        name, _ = datasets.name_and_fingerprint(sequence)
        runs, row = self._rows.get((self._label(tracker), name), (None, None))
        return next(runs.read([row])) if runs is not None and row is not None else None

    def _measured_run(self, tracker: str, sequence: str) -> MeasuredRun | None:
        """Return the run of a tracker on a sequence (specifications) with its ground truth.

        The boxes of the ground truth are those of the tracker's init region.
        """
        if (stored_run := self.stored_run(tracker, sequence)) is None:
            return None
        _, run, truth = stored_run
        init = select_ground_truth(truth, run.identity.init, run.identity.sequence)
        return MeasuredRun(run, replace(truth, boxes=init.boxes), self._rules)

    def values(self, case: Case, measure: Measure) -> pd.DataFrame:
        """Return a measure by scene.

        Values of a sequence with several members are summed, or averaged if the measure says so.
        Scenes are omitted if a member has no run or if its measure is NaN. Columns: `sequence`,
        `rank` (index of the scene, from 0), `scene` (specification of its first member), `tracker`
        (specification), `value`.
        """
        rows = []
        for rank, members in enumerate(case.scenes):
            runs = [self.measured_run(case.tracker, member) for member in members]
            values = [nan if measured is None else measure(measured) for measured in runs]
            value = sum(values) / (len(members) if measure.averaged else 1)
            if not isnan(value):
                rows.append((case.sequence.name, rank, members[0], case.tracker, value))
        return pd.DataFrame(rows, columns=["sequence", "rank", "scene", "tracker", "value"])


@dataclass(frozen=True)
class Context:
    """Input of tables, figures and functions in a paper's modules."""

    paper: Paper
    runs: PaperRuns  # requested runs
    folder: Path  # of the report
    options: ReproductionOptions

    @property
    def n_scenes(self) -> int:
        """Number of scenes per sequence in tables and figures."""
        return self.paper.n_scenes(quick=self.options.quick)

    def case(self, tracker: PaperTracker, sequence: PaperSequence, setting: str) -> Case:
        """Return the runs of a tracker in a setting that tables and figures show."""
        return Case(tracker.spec(setting), sequence, self.n_scenes)

    @property
    def jobs(self) -> int:
        """Number of worker processes."""
        return self.options.jobs or os.cpu_count() or 1
