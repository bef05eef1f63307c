"""CPU times of a frame; the paper gives none."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from bench.papers.moreno2005.scores import labels_of
from bench.papers.moreno2005.tables import UNPUBLISHED, way_words
from bench.papers.timed import timed_runs
from bench.store.layout import Cell as StoredCell
from reports.tables import Cell, Table

__all__ = ["frame_times", "time_table"]

ALL_DISTURBED = "other load disturbed every run: time again on an idle machine"

_HEADS = ["method", "setting", "mean [ms]", "median [ms]", "runs"]
_WAY = ["method", "preset", "variant", "mixing", "plane"]


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """Times of the runs that no load disturbed, a row a run.

    Returns
    -------
    DataFrame
        What `scores.labels_of` gives, `milliseconds` and `median` (CPU time of a frame).
    """
    columns = [*_WAY, "milliseconds", "median"]
    rows = []
    for run in timed_runs(folder, cells):
        assert run.times is not None
        seconds = run.times.cpu[np.isfinite(run.times.cpu)]
        labels = labels_of(run.identity.tracker)
        middle = float(np.median(seconds))
        rows.append(labels | {"milliseconds": 1e3 * seconds.mean(), "median": 1e3 * middle})
    return pd.DataFrame(rows, columns=columns)


def time_table(times: pd.DataFrame, failed: Sequence[str] = ()) -> Table:
    """Times by method.

    Parameters
    ----------
    times : DataFrame
        See `frame_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    rows = []
    for way in times[_WAY].drop_duplicates().itertuples(index=False, name=None):
        runs = times[(times[_WAY] == list(way)).all(axis=1)]
        method, setting = way_words(*way)
        milliseconds, median = runs["milliseconds"].mean(), runs["median"].mean()
        rows.append([method, setting, f"{milliseconds:.1f}", f"{median:.1f}", str(len(runs))])
    return Table(
        name="time",
        caption=(
            "CPU time a frame of 320 x 240 pixels on one thread, by runs that no other load "
            f"disturbed. {UNPUBLISHED.capitalize()}"
        ),
        heads=_HEADS,
        n_labels=2,
        rows=[[Cell(text) for text in row] for row in rows],
        notes=[*(() if rows else (ALL_DISTURBED,)), *failed],
        data=pd.DataFrame(rows, columns=_HEADS),
    )
