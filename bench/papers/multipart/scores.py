"""Stored runs of the multi-part tracker as one tidy frame, the proposed method among them."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import datasets
from bench.papers.multipart.static import INITIAL
from bench.store.files import ResultsError
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results
from datasets.text_form import parse_text

__all__ = [
    "METRICS",
    "adaptive_rows",
    "cells_of",
    "part_distances",
    "tidy_scores",
    "without_failures",
]

METRICS = ("success_frames", "frames_inside", "first_loss")
"""Three readings of "numbers of frames of tracking successfully", of equal rank."""

_NO_VARIANT = {"representation", "init"}
_SCORES = ("success_frames", "frames_inside", "first_loss", "mean_overlap")
_OF_RUNS = {
    *("representation", "threshold", "repetition", "path", "failure", "part_distance"),
    *_SCORES,
}


def tidy_scores(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Scores of an experiment's runs, one row a run.

    Parameters
    ----------
    folder : Path
        Results of an experiment with `multipart` on synthetic sequences.
    cells : collection of Cell, optional
        The runs that are meant; all by default.

    Returns
    -------
    DataFrame
        `representation`, `sequence` (without variant), `scene`, `light`, options of the
        sequence beyond these in columns of their own, `initial` (full, body, tight),
        `variant` (other parameters than those of `as-written`, in text form; empty for
        none), `repetition`, `frames` (length with the given first frame), `success_frames`,
        `frames_inside` (both count the given frame), `first_loss` (frames before the loss),
        `mean_overlap`, `part_distance` (d[p1, p2] at initialisation), `path`, `failure` (a
        line that names the run and says why it failed; such a run has no scores).

    Raises
    ------
    ResultsError
        Where a run is missing or stale: no verdict is passed on what is left.
    """
    runs = load_results(folder, cells)
    lacking = runs[~runs["status"].isin(["finished", "failed"])]
    if len(lacking):
        first = lacking.iloc[0]
        raise ResultsError(
            f"{folder}: {len(lacking)} of {len(runs)} runs are {first['status']}, the first "
            f"{first['tracker']} on {first['sequence']}, repetition {first['repetition']}. "
            "Run `trackmark reproduce` again; `trackmark results list` shows them."
        )
    rows = pd.DataFrame([_labels(row) for _, row in runs.iterrows()])
    scores = {name: runs.get(name, pd.Series(np.nan, runs.index)).to_numpy() for name in _SCORES}
    cells_of_runs = runs[["tracker", "sequence", "repetition", "protocol"]]
    rows = rows.assign(
        repetition=runs["repetition"].to_numpy(),
        frames=runs["frames"].to_numpy(np.int64),
        success_frames=scores["success_frames"] + 1,
        frames_inside=scores["frames_inside"] + 1,
        first_loss=scores["first_loss"],
        mean_overlap=scores["mean_overlap"],
        path=[str(folder / run_path(*cell)) for cell in cells_of_runs.itertuples(index=False)],
        failure=[_failure(run) for _, run in runs.iterrows()],
    )
    return rows.assign(part_distance=part_distances(folder, rows))


def _failure(run: "pd.Series[Any]") -> str:
    if not run["failure"]:
        return ""
    reason = str(run["failure"]).partition("\n")[0]
    return f"{run['tracker']} on {run['sequence']}, repetition {run['repetition']}: {reason}"


def cells_of(scores: pd.DataFrame) -> pd.DataFrame:
    """The cell of each run: a scene under one reading, in whatever representation."""
    return scores[[column for column in scores if column not in _OF_RUNS]]


def without_failures(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of those cells alone in which no run failed.

    Left in a cell, the other repetitions would stand for the failed one, and the other
    representation would be compared with nothing.
    """
    cells = cells_of(scores)
    failed = cells[scores["failure"] != ""].drop_duplicates()
    if failed.empty:
        return scores
    side = cells.merge(failed, "left", indicator="side")["side"]
    return scores[(side == "left_only").to_numpy()]


def _labels(run: "pd.Series[Any]") -> dict[str, Any]:
    _, options = parse_text(run["tracker"])
    name, variant = parse_text(run["sequence"])
    parameters = json.loads(run["parameters"])
    others = [f"{key}={value}" for key, value in options.items() if key not in _NO_VARIANT]
    return {
        "representation": parameters["representation"],
        "threshold": parameters["threshold"],
        "sequence": name,
        "initial": INITIAL[options.get("init", "boxes")],
        "variant": ":".join(others),
        **{
            knob["name"]: type(knob["default"])(variant.get(knob["name"], knob["default"]))
            for knob in datasets.options(name)
        },
    }


def part_distances(folder: Path, rows: pd.DataFrame) -> list[float]:
    """d[p1, p2] of every run's first frame: read once for all runs that share it.

    NaN where all of these failed.
    """
    results = Results(folder)
    known: dict[Any, float] = {}
    keys = list(cells_of(rows).itertuples(index=False, name=None))
    for key, path, failure in zip(keys, rows["path"], rows["failure"], strict=True):
        if key not in known and not failure:
            values = results.read(Path(path)).details["part_distance"]
            known[key] = float(values[np.isfinite(values)][0])
    return [known.get(key, np.nan) for key in keys]


def adaptive_rows(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of the proposed method: those of the representation that it picks (Eq. 7).

    With equal random numbers they are the same to the bit, so they are copied, not run.
    """
    picks_multi = scores["part_distance"] > scores["threshold"]
    picked = np.where(picks_multi, "multi", "single")
    return scores[scores["representation"] == picked].assign(representation="adaptive")
