"""Timing runs of every paper: those that no load disturbed, and those that failed."""

from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from bench.evaluation.record import Run
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results

__all__ = ["failed_passes", "frame_times", "timed_runs", "undisturbed_lacking"]


def timed_runs(folder: Path, cells: Collection[Cell] | None = None) -> Iterator[Run]:
    """Finished timing runs of an experiment that no load disturbed; they have `times`."""
    results = Results(folder)
    runs = load_results(folder, cells)
    finished = runs[runs["status"] == "finished"]
    for _, run in (finished[finished["disturbed"] == 0] if len(finished) else finished).iterrows():
        path = run_path(run["tracker"], run["sequence"], run["repetition"], run["protocol"])
        stored = results.read(folder / path)
        if stored.times is not None:
            yield stored


def frame_times(
    folder: Path, cells: Collection[Cell] | None = None, details: Collection[str] = ()
) -> pd.DataFrame:
    """CPU time of every frame of the timing runs that no load disturbed.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    details : collection of str
        Of the tracker, which stand beside.

    Returns
    -------
    DataFrame
        `tracker` (its label), `sequence`, `repetition`, `frame`, `seconds` and the details.
    """
    columns = ["tracker", "sequence", "repetition", "frame", "seconds", *details]
    pieces = [pd.DataFrame(columns=columns)]
    for run in timed_runs(folder, cells):
        assert run.times is not None
        key, timed = run.identity, np.flatnonzero(np.isfinite(run.times.cpu))
        known = {"frame": timed, "seconds": run.times.cpu[timed]}
        rows = pd.DataFrame(known | {name: run.details[name][timed] for name in details})
        rows = rows.assign(tracker=key.tracker, sequence=key.sequence, repetition=key.repetition)
        pieces.append(rows[columns])
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def undisturbed_lacking(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """What a reader must know where there is no time to tell, in a line or none."""
    if any(True for _ in timed_runs(folder, cells)):
        return []
    return [f"{folder.name}: other load disturbed every run; time again on an idle machine."]


def failed_passes(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """Timing runs that failed, each in a line with the reason."""
    runs = load_results(folder, cells)
    return [
        f"failed: {run['tracker']} on {run['sequence']}, repetition {run['repetition']}: "
        + str(run["failure"]).partition("\n")[0]
        for _, run in runs[runs["status"] == "failed"].iterrows()
    ]
