"""Timing runs of every paper: those that no load disturbed, and those that failed."""

from collections.abc import Collection, Iterator
from pathlib import Path

from bench.evaluation.record import Run
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results

__all__ = ["failed_passes", "timed_runs"]


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


def failed_passes(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """Timing runs that failed, each in a line with the reason."""
    runs = load_results(folder, cells)
    return [
        f"failed: {run['tracker']} on {run['sequence']}, repetition {run['repetition']}: "
        + str(run["failure"]).partition("\n")[0]
        for _, run in runs[runs["status"] == "failed"].iterrows()
    ]
