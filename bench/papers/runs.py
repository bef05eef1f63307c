"""Stored runs of a paper's experiments, by tracker and sequence, and their measures by scene."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cache, cached_property
from math import isnan
from pathlib import Path
from typing import TypeAlias

import pandas as pd

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.description import Description
from trackmark.bench.papers.measures import Course, Measure
from trackmark.bench.papers.plan import scene_names
from trackmark.bench.store.data_frames import load_results
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import RUN_KEY_COLUMNS, RunKey
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth

StoredPlace: TypeAlias = tuple[Path, RunKey]
"""Folder of the experiment and key of a run."""


class StoredRuns:
    """Runs of the experiments of a paper that this call asked for.

    Parameters
    ----------
    results : Path
        Folder of all experiments.
    asked : mapping of str to collection of RunKey
        The runs that are meant, by experiment.
    description : Description
        The paper.

    Raises
    ------
    ResultsError
        If a run is missing or was made with another version of its tracker.
    """

    def __init__(
        self, results: Path, asked: Mapping[str, Collection[RunKey]], description: Description
    ) -> None:
        self._results, self._asked, self._description = results, asked, description
        self.courses = cache(self._courses)
        self._truth = cache(read_truth)

    @cached_property
    def _files(self) -> dict[tuple[str, str], list[StoredPlace]]:
        found: dict[tuple[str, str], dict[int, StoredPlace]] = {}
        for experiment, cells in self._asked.items():
            folder = self._results / experiment
            runs = load_results(folder, cells)
            unusable = runs[~runs["status"].isin(["finished", "failed"])]
            if len(unusable):
                first = unusable.iloc[0]
                raise ResultsError(
                    f"{folder}: {len(unusable)} of {len(runs)} runs are {first['status']}, the "
                    f"first {first['tracker']} on {first['sequence']}, repetition "
                    f"{first['repetition']}. Run `trackmark reproduce` again."
                )
            for cell in runs[[*RUN_KEY_COLUMNS]].itertuples(index=False, name=None):
                place = found.setdefault((cell[0], cell[1]), {})
                place.setdefault(cell[2], (folder, cell))
        return {key: [files[k] for k in sorted(files)] for key, files in found.items()}

    def files(self, tracker: str, sequence: str) -> list[StoredPlace]:
        """Return the places of a tracker's runs on a sequence (text forms), by repetition."""
        key = parse_tracker(tracker).label, datasets.identity(sequence)[0]
        return self._files.get(key, [])

    def _courses(self, tracker: str, sequence: str) -> list[Course]:
        """Return the runs of a tracker on a sequence (text forms) beside their ground truth.

        The boxes of the ground truth are those of the region that the runs started from.
        """
        found = []
        for folder, cell in self.files(tracker, sequence):
            run = Results(folder).read(cell)
            truth = self._truth(folder, run.identity.sequence, run.identity.fingerprint)
            started_from = select_ground_truth(truth, run.identity.init, run.identity.sequence)
            truth = replace(truth, boxes=started_from.boxes)
            found.append(Course(run, truth, self._description, tracker))
        return found

    def failures(self, tracker: str, sequence: str) -> list[str]:
        """Return a line for each failed run: where it failed, and why."""
        return [
            f"{course.run.identity.sequence}, {course.run.failure.partition(chr(10))[0]}"
            for course in self.courses(tracker, sequence)
            if course.run.failure
        ]

    def values(
        self, tracker: str, sequence: str, measure: Measure, scenes: int, on: str = ""
    ) -> pd.DataFrame:
        """Return a measure by scene of a sequence of `paper.toml`, the mean over repetitions.

        Values of a sequence with several members are added up. Scenes without runs are left out,
        and those in whose runs what is measured does not arise (NaN).

        Returns
        -------
        DataFrame
            `sequence`, `rank` (of the scene, from 0), `scene` (text form of its first member),
            `tracker` (text form), `value`.
        """
        rows = []
        for rank, members in enumerate(scene_names(self._description, sequence, scenes, on)):
            runs = [self.courses(tracker, member) for member in members]
            if not all(runs):
                continue
            values = [[measure(course) for course in courses] for courses in runs]
            known = [[value for value in one if not isnan(value)] for one in values]
            if all(known):
                total = sum(sum(one) / len(one) for one in known)
                rows.append((sequence, rank, members[0], tracker, total))
        return pd.DataFrame(rows, columns=["sequence", "rank", "scene", "tracker", "value"])
