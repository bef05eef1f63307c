"""Stored runs of a paper's experiments, and their measures by scene.

`Context` passes the runs, the paper and the report's folder to tables and figures.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import isnan
from pathlib import Path
from typing import TypeAlias

import pandas as pd

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import ReproductionOptions, plan
from trackmark.bench.papers.cases import Case
from trackmark.bench.papers.measures import FrameRules, Measure, MeasuredRun
from trackmark.bench.papers.paper import Paper
from trackmark.bench.store.data_frames import load_table
from trackmark.bench.store.keys import RUN_KEY_COLUMNS, ResultsError, RunKey
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import read_truth

StoredKey: TypeAlias = tuple[Path, RunKey]
"""Folder of an experiment and key of a run in it."""


class PaperRuns:
    """Stored runs of a paper.

    `results_root`: folder of all experiments. `requested`: run keys by experiment. Raises
    `ResultsError` if a run is missing or stale.
    """

    def __init__(
        self, results_root: Path, requested: Mapping[str, Collection[RunKey]], rules: FrameRules
    ) -> None:
        self._results_root, self._requested, self._rules = results_root, requested, rules
        self.measured_runs = cache(self._measured_runs)
        self._truth = cache(read_truth)

    @cached_property
    def _keys(self) -> dict[tuple[str, str], list[StoredKey]]:
        keys: dict[tuple[str, str], dict[int, StoredKey]] = {}
        for experiment, requested in self._requested.items():
            folder = self._results_root / experiment
            runs = load_table(folder, requested)
            unusable = runs[~runs["status"].isin(["finished", "failed"])]
            if len(unusable):
                first = unusable.iloc[0]
                raise ResultsError(
                    f"{folder}: {len(unusable)} of {len(runs)} runs are {first['status']}; the "
                    f"first is {first['tracker']} on {first['sequence']}, repetition "
                    f"{first['repetition']}. Run `trackmark reproduce` again."
                )
            for key in runs[[*RUN_KEY_COLUMNS]].itertuples(index=False, name=None):
                by_repetition = keys.setdefault((key[0], key[1]), {})
                by_repetition.setdefault(key[2], (folder, key))
        return {
            run: [key for _, key in sorted(by_repetition.items())]
            for run, by_repetition in keys.items()
        }

    def keys(self, tracker: str, sequence: str) -> list[StoredKey]:
        """Return folders and keys of runs on a sequence (both specifications), by repetition."""
        return self._keys.get(
            (parse_tracker(tracker).label, datasets.name_and_fingerprint(sequence)[0]), []
        )

    def _measured_runs(self, tracker: str, sequence: str) -> list[MeasuredRun]:
        """Return the runs of a tracker on a sequence (specifications) with their ground truth.

        The boxes of the ground truth are those of the tracker's init region.
        """
        measured_runs = []
        for folder, key in self.keys(tracker, sequence):
            run = RunStore(folder).read(key)
            truth = self._truth(folder, run.identity.sequence, run.identity.fingerprint)
            init = select_ground_truth(truth, run.identity.init, run.identity.sequence)
            measured_runs.append(MeasuredRun(run, replace(truth, boxes=init.boxes), self._rules))
        return measured_runs

    def values(self, case: Case, measure: Measure) -> pd.DataFrame:
        """Return a measure by scene, as mean over repetitions.

        Values of a sequence with several members are summed. Scenes are omitted if they have no
        runs or if the measure is NaN in all runs. Columns: `sequence`, `rank` (index of the scene,
        from 0), `scene` (specification of its first member), `tracker` (specification), `value`.
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
                rows.append((case.sequence.name, rank, members[0], case.tracker, total))
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
