"""Stored runs of a paper's experiments, and what they say over frames."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from bench.evaluation.record import Run
from bench.experiments.contestant import contestant
from bench.papers import Asked
from bench.store.layout import run_path
from bench.store.loading import load_results
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth

__all__ = ["StoredRuns", "over_frames"]

_CELL = ["tracker", "sequence", "repetition", "protocol"]


class StoredRuns:
    """Finished runs that this call asked for.

    Parameters
    ----------
    results : Path
        Folder of all experiments.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    """

    def __init__(self, results: Path, asked: Asked) -> None:
        self._results, self._asked = results, asked
        self._listed = cache(self._list)

    def of(self, experiment: str, sequence: str, tracker: str) -> list[Run]:
        """Runs on a sequence, in order of their repetitions; none where none was asked for.

        Parameters
        ----------
        experiment : str
            Name.
        sequence : str
            Canonical name.
        tracker : str
            Text form.
        """
        label = contestant(tracker).label
        runs = self._listed(experiment)
        runs = runs[(runs["tracker"] == label) & (runs["sequence"] == sequence)]
        results = Results(self._results / experiment)
        places = runs.sort_values("repetition")[_CELL]
        return [
            results.read(results.folder / run_path(*place))
            for place in places.itertuples(index=False, name=None)
        ]

    def read(self, path: str) -> Run:
        """A run by its file, as `path` among the scores says."""
        file = Path(path)
        return Results(file.parent.parent.parent).read(file)

    def sequences(self, experiment: str) -> list[str]:
        """Canonical names of the sequences that there are runs on, in the order of the runs."""
        return [str(name) for name in self._listed(experiment)["sequence"].unique()]

    def truth(self, experiment: str, run: Run) -> StoredTruth:
        """Truth that a run was made with."""
        key = run.identity
        return read_truth(self._results / experiment, key.sequence, key.fingerprint)

    def _list(self, experiment: str) -> pd.DataFrame:
        if experiment not in self._asked:
            return pd.DataFrame(columns=_CELL)
        runs = load_results(self._results / experiment, self._asked[experiment])
        return runs[runs["status"] == "finished"]


def over_frames(runs: Mapping[str, list[Run]], *details: str) -> pd.DataFrame:
    """Details of runs, a row a frame in which the tracker said something.

    Parameters
    ----------
    runs : mapping of str to list of Run
        By label.
    *details : str
        Names.

    Returns
    -------
    DataFrame
        `label`, `repetition`, `frame` and the details.
    """
    pieces = [pd.DataFrame(columns=["label", "repetition", "frame", *details])]
    for label, repetitions in runs.items():
        for run in repetitions:
            columns = {name: run.details[name] for name in details}
            rows = pd.DataFrame({"label": label, "repetition": run.identity.repetition} | columns)
            pieces.append(rows.assign(frame=np.arange(len(rows))).dropna())
    return pd.concat(pieces[1:] or pieces, ignore_index=True)
