"""Stored runs of a paper's experiments, and their measures by scene.

`Context` passes the runs, the paper and the report's folder to tables and figures.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import isnan
from pathlib import Path
from typing import Any

import pandas as pd

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import ReproductionOptions, plan
from trackmark.bench.papers.cases import Case
from trackmark.bench.papers.measures import FrameRules, Measure, MeasuredRun
from trackmark.bench.papers.paper import Paper
from trackmark.bench.store.keys import ResultsError, RunKey, run_key
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
        self.stored_runs = cache(self._stored_runs)
        self.measured_runs = cache(self._measured_runs)
        # Parsing reads the metadata of all installed packages: about 20 ms.
        self._label = cache(lambda tracker: parse_tracker(tracker).label)

    @cached_property
    def _rows(self) -> dict[tuple[str, str], tuple[Runs, dict[int, Mapping[str, Any]]]]:
        """Rows by repetition with the runs of their experiment, by tracker and sequence."""
        rows: dict[tuple[str, str], tuple[Runs, dict[int, Mapping[str, Any]]]] = {}
        for experiment, keys in self._requested.items():
            runs, requested_keys = (
                Runs.open(self._results_root / experiment).select(keys),
                set(keys),
            )
            requested = [row for row in runs.rows if run_key(row) in requested_keys]
            unusable = [row for row in requested if row["status"] not in ("finished", "failed")]
            if unusable:
                first = unusable[0]
                raise ResultsError(
                    f"{runs.folder}: {len(unusable)} of {len(requested)} runs are "
                    f"{first['status']}; the first is {first['tracker']} on {first['sequence']}, "
                    f"repetition {first['repetition']}. Run `trackmark reproduce` again."
                )
            for row in requested:
                _, by_repetition = rows.setdefault((row["tracker"], row["sequence"]), (runs, {}))
                by_repetition.setdefault(row["repetition"], row)
        return rows

    def _stored_runs(self, tracker: str, sequence: str) -> list[RunWithTruth]:
        """Return the runs of a tracker on a sequence (both specifications), by repetition."""
        name, _ = datasets.name_and_fingerprint(sequence)
        pair = self._label(tracker), name
        if pair not in self._rows:
            return []
        runs, by_repetition = self._rows[pair]
        return list(runs.read(row for _, row in sorted(by_repetition.items())))

    def _measured_runs(self, tracker: str, sequence: str) -> list[MeasuredRun]:
        """Return the runs of a tracker on a sequence (specifications) with their ground truth.

        The boxes of the ground truth are those of the tracker's init region.
        """
        measured_runs = []
        for _, run, truth in self.stored_runs(tracker, sequence):
            init = select_ground_truth(truth, run.identity.init, run.identity.sequence)
            measured_runs.append(MeasuredRun(run, replace(truth, boxes=init.boxes), self._rules))
        return measured_runs

    def values(self, case: Case, measure: Measure) -> pd.DataFrame:
        """Return a measure by scene, as mean over repetitions.

        Values of a sequence with several members are summed, or averaged if the measure says so.
        Scenes are omitted if they have no runs or if the measure is NaN in all runs. Columns:
        `sequence`, `rank` (index of the scene, from 0), `scene` (specification of its first
        member), `tracker` (specification), `value`.
        """
        rows = []
        for rank, members in enumerate(case.scenes):
            runs = [self.measured_runs(case.tracker, member) for member in members]
            if not all(runs):
                continue
            values = [[measure(measured) for measured in runs_of] for runs_of in runs]
            defined = [[value for value in run_values if not isnan(value)] for run_values in values]
            if all(defined):
                total = sum(sum(numbers) / len(numbers) for numbers in defined)
                value = total / len(members) if measure.averaged else total
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
        return self.paper.quick_scenes if self.options.quick else plan.MAIN_SCENES

    @cached_property
    def jobs(self) -> int:
        """Number of worker processes."""
        return self.options.jobs or os.cpu_count() or 1
