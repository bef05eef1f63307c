"""Times: of timing runs that no load disturbed, and of several things taken in turns."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

import datasets
from bench.evaluation.record import Run
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results
from trackers.base.interface import Box, Image

__all__ = [
    "Update",
    "beginning",
    "failed_passes",
    "frame_times",
    "in_turns",
    "slope",
    "undisturbed_lacking",
]

Update: TypeAlias = Callable[[Image], Any]


def frame_times(
    folder: Path,
    cells: Collection[Cell] | None = None,
    details: Collection[str] = (),
    *,
    disturbed: bool = False,
) -> pd.DataFrame:
    """CPU time of every frame of the timing runs of an experiment.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    details : collection of str
        Of the tracker, which stand beside.
    disturbed : bool
        Whether runs that other load disturbed count, too.

    Returns
    -------
    DataFrame
        `tracker` (its label), `sequence`, `repetition`, `disturbed` (1: it was), `frame`, `seconds`
        and the details.
    """
    columns = ["tracker", "sequence", "repetition", "disturbed", "frame", "seconds", *details]
    pieces = [pd.DataFrame(columns=columns)]
    for run, load in _passes(folder, cells):
        if (load and not disturbed) or run.times is None:
            continue
        key, timed = run.identity, np.flatnonzero(np.isfinite(run.times.cpu))
        known = {"frame": timed, "seconds": run.times.cpu[timed]}
        rows = pd.DataFrame(known | {name: run.details[name][timed] for name in details})
        rows = rows.assign(tracker=key.tracker, sequence=key.sequence, repetition=key.repetition)
        pieces.append(rows.assign(disturbed=load)[columns])
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def _passes(folder: Path, cells: Collection[Cell] | None) -> Iterator[tuple[Run, int]]:
    """Finished timing runs, and whether load disturbed them."""
    results, runs = Results(folder), load_results(folder, cells)
    for _, run in runs[runs["status"] == "finished"].iterrows():
        path = run_path(run["tracker"], run["sequence"], run["repetition"], run["protocol"])
        yield results.read(folder / path), run["disturbed"]


def undisturbed_lacking(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """What a reader must know where there is no time to tell, in a line or none."""
    if any(not disturbed for _, disturbed in _passes(folder, cells)):
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


def beginning(name: str, frames: int) -> tuple[list[Image], Box]:
    """The first image with the target and as many more as there are of `frames`, and its box."""
    sequence = datasets.load(name)
    first = sequence.first_frame
    stop = min(first + frames + 1, len(sequence))
    return [sequence[frame] for frame in range(first, stop)], sequence.boxes[first]


def in_turns(
    updates: Mapping[str, Update], images: Iterable[Image], *, shuffled: bool = True
) -> pd.DataFrame:
    """Show every image to each.

    Parameters
    ----------
    updates : mapping of str to callable
        What is timed.
    images : iterable of ndarray
        In order; the first one warms up and is left out.
    shuffled : bool
        Whether the order among them is drawn anew for each image.

    Returns
    -------
    DataFrame
        A row an image, a column each: CPU seconds.
    """
    order, random = list(updates), np.random.default_rng(0)
    rows: list[dict[str, float]] = []
    for image in images:
        if shuffled:
            random.shuffle(order)
        row = {}
        for label in order:
            began = thread_time()
            updates[label](image)
            row[label] = thread_time() - began
        rows.append(row)
    return pd.DataFrame(rows[1:])[list(updates)]


def slope(values: "pd.Series[float]", seconds: "pd.Series[float]") -> dict[str, float]:
    """What the time grows by with each one more.

    Returns
    -------
    dict of str to float
        `slope` of the line through the times, `lower_limit` and `upper_limit` of its 95 %
        interval [seconds], and `r_squared`.
    """
    from scipy.special import stdtrit
    from scipy.stats import linregress

    line = linregress(values.to_numpy(float), seconds.to_numpy(float))
    half = float(stdtrit(len(values) - 2, 0.975)) * line.stderr
    return {
        "slope": line.slope,
        "lower_limit": line.slope - half,
        "upper_limit": line.slope + half,
        "r_squared": line.rvalue**2,
    }
