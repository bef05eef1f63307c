"""Stored runs of a paper's experiments, and their measures by scene.

`Context` passes the runs, the paper and the report's folder to tables and figures.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import isnan
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

from trackmark import datasets
from trackmark.bench.claims.claims_file import Claim
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import Effort, plan
from trackmark.bench.papers.description import Description
from trackmark.bench.papers.measures import JudgedRun, Measure, find_function
from trackmark.bench.papers.plan import scene_names
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import RUN_KEY_COLUMNS, RunKey
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth

StoredPlace: TypeAlias = tuple[Path, RunKey]
"""Folder of an experiment and key of a run in it."""


class StoredRuns:
    """Stored runs of a paper.

    `results`: folder of all experiments. `requested`: run keys by experiment. Raises `ResultsError`
    if a run is missing or stale.
    """

    def __init__(
        self, results: Path, requested: Mapping[str, Collection[RunKey]], description: Description
    ) -> None:
        self._results, self._requested, self._description = results, requested, description
        self.judged_runs = cache(self._judged_runs)
        self._truth = cache(read_truth)

    @cached_property
    def _files(self) -> dict[tuple[str, str], list[StoredPlace]]:
        places: dict[tuple[str, str], dict[int, StoredPlace]] = {}
        for experiment, cells in self._requested.items():
            folder = self._results / experiment
            runs = load_runs(folder, cells)
            unusable = runs[~runs["status"].isin(["finished", "failed"])]
            if len(unusable):
                first = unusable.iloc[0]
                raise ResultsError(
                    f"{folder}: {len(unusable)} of {len(runs)} runs are {first['status']}; the "
                    f"first is {first['tracker']} on {first['sequence']}, repetition "
                    f"{first['repetition']}. Run `trackmark reproduce` again."
                )
            for cell in runs[[*RUN_KEY_COLUMNS]].itertuples(index=False, name=None):
                place = places.setdefault((cell[0], cell[1]), {})
                place.setdefault(cell[2], (folder, cell))
        return {key: [files[k] for k in sorted(files)] for key, files in places.items()}

    def files(self, tracker: str, sequence: str) -> list[StoredPlace]:
        """Return folders and keys of runs on a sequence (both specifications), by repetition."""
        key = parse_tracker(tracker).label, datasets.identity(sequence)[0]
        return self._files.get(key, [])

    def _judged_runs(self, tracker: str, sequence: str) -> list[JudgedRun]:
        """Return the runs of a tracker on a sequence (specifications) with their ground truth.

        The boxes of the ground truth are those of the tracker's init region.
        """
        judged_runs = []
        for folder, cell in self.files(tracker, sequence):
            run = Results(folder).read(cell)
            truth = self._truth(folder, run.identity.sequence, run.identity.fingerprint)
            started_from = select_ground_truth(truth, run.identity.init, run.identity.sequence)
            truth = replace(truth, boxes=started_from.boxes)
            judged_runs.append(JudgedRun(run, truth, self._description, tracker))
        return judged_runs

    def failures(self, tracker: str, sequence: str) -> list[str]:
        """Return a line for each failed run with place and reason of the failure."""
        return [
            f"{judged.run.identity.sequence}, {judged.run.failure.partition(chr(10))[0]}"
            for judged in self.judged_runs(tracker, sequence)
            if judged.run.failure
        ]

    def values(
        self, tracker: str, sequence: str, measure: Measure, scenes: int, on: str = ""
    ) -> pd.DataFrame:
        """Return a measure by scene of a sequence of `paper.toml`, as mean over repetitions.

        Values of a sequence with several members are summed. Scenes are omitted if they have no
        runs or if the measure is NaN in all runs. Columns: `sequence`, `rank` (index of the scene,
        from 0), `scene` (specification of its first member), `tracker` (specification), `value`.
        """
        rows = []
        for rank, members in enumerate(scene_names(self._description, sequence, scenes, on)):
            runs = [self.judged_runs(tracker, member) for member in members]
            if not all(runs):
                continue
            values = [[measure(judged) for judged in judged_runs] for judged_runs in runs]
            defined = [[value for value in run_values if not isnan(value)] for run_values in values]
            if all(defined):
                total = sum(sum(numbers) / len(numbers) for numbers in defined)
                rows.append((sequence, rank, members[0], tracker, total))
        return pd.DataFrame(rows, columns=["sequence", "rank", "scene", "tracker", "value"])


@dataclass(frozen=True)
class Context:
    """Input of tables, figures and functions in a paper's modules."""

    description: Description  # claims of the paper
    claims: Mapping[str, Claim]
    runs: StoredRuns  # requested runs
    folder: Path  # of the report
    effort: Effort

    @property
    def scenes(self) -> int:
        """Number of scenes per sequence in tables and figures."""
        return self.description.quick_scenes if self.effort.quick else plan.MAIN_SCENES

    @cached_property
    def jobs(self) -> int:
        """Number of worker processes."""
        return self.effort.jobs or os.cpu_count() or 1

    def function(self, name: str) -> Any:
        """Return a function in the paper's modules, named as `module.function`."""
        return find_function(name, self.description.name)
