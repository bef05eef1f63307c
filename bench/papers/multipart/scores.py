"""Stored runs of the multi-part tracker as one tidy frame, the proposed method among them."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bench.papers.multipart.static import INITIAL
from bench.papers.scores import counts_of, runs_of, sequence_labels
from bench.papers.scores import without_failures as scores_without_failures
from bench.store.layout import Cell
from bench.store.results import Results
from datasets.text_form import parse_text

__all__ = [
    "METRICS",
    "adaptive_rows",
    "cell_columns",
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
    runs = runs_of(folder, cells)
    labels = pd.DataFrame([_labels(row) for _, row in runs.iterrows()])
    rows = labels.join(counts_of(folder, runs))
    return rows.assign(part_distance=part_distances(folder, rows))


def cell_columns(scores: pd.DataFrame) -> list[str]:
    """Columns that say which cell a run is in: a scene under one reading, all representations."""
    return [str(column) for column in scores if column not in _OF_RUNS]


def without_failures(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of those cells alone in which no run failed, in whatever representation."""
    return scores_without_failures(scores, cell_columns(scores))


def _labels(run: "pd.Series[Any]") -> dict[str, Any]:
    _, options = parse_text(run["tracker"])
    parameters = json.loads(run["parameters"])
    others = [f"{key}={value}" for key, value in options.items() if key not in _NO_VARIANT]
    return {
        "representation": parameters["representation"],
        "threshold": parameters["threshold"],
        **sequence_labels(run["sequence"]),
        "initial": INITIAL[options.get("init", "boxes")],
        "variant": ":".join(others),
    }


def part_distances(folder: Path, rows: pd.DataFrame) -> list[float]:
    """d[p1, p2] of every run's first frame: read once for all runs that share it.

    NaN where all of these failed.
    """
    results = Results(folder)
    known: dict[Any, float] = {}
    keys = list(rows[cell_columns(rows)].itertuples(index=False, name=None))
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
