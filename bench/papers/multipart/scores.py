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
from bench.store.index import load_results
from bench.store.layout import Cell
from bench.store.results import Results
from datasets.text_form import parse_text

__all__ = ["METRICS", "adaptive_rows", "part_distances", "tidy_scores"]

METRICS = ("success_frames", "frames_inside", "first_loss")
"""Three readings of "numbers of frames of tracking successfully", of equal rank."""

_NO_VARIANT = {"representation", "init"}


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
        `mean_overlap`, `part_distance` (d[p1, p2] at initialisation), `path`.

    Raises
    ------
    ResultsError
        Where a run is missing, stale or failed: no verdict is passed on what is left.
    """
    runs = load_results(folder, cells)
    lacking = runs[runs["status"] != "finished"]
    if len(lacking):
        first = lacking.iloc[0]
        raise ResultsError(
            f"{folder}: {len(lacking)} of {len(runs)} runs are {first['status']}, the first "
            f"{first['tracker']} on {first['sequence']}, repetition {first['repetition']}"
            f"{': ' + str(first['failure']).splitlines()[0] if first['failure'] else ''}. "
            "Run `trackmark reproduce` again; `trackmark results list` shows them."
        )
    rows = pd.DataFrame([_labels(row) for _, row in runs.iterrows()])
    distances = part_distances(folder, runs, rows)
    return rows.assign(
        repetition=runs["repetition"].to_numpy(),
        frames=runs["frames"].to_numpy(np.int64),
        success_frames=runs["success_frames"].to_numpy() + 1,
        frames_inside=runs["frames_inside"].to_numpy() + 1,
        first_loss=runs["first_loss"].to_numpy(),
        mean_overlap=runs["mean_overlap"].to_numpy(),
        part_distance=distances,
        path=[str(folder / path) for path in runs["path"]],
    )


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


def part_distances(folder: Path, runs: pd.DataFrame, rows: pd.DataFrame) -> list[float]:
    """d[p1, p2] of every run's first frame: read once for all runs that share it."""
    results = Results(folder)
    known: dict[tuple[Any, ...], float] = {}
    found = []
    for path, sequence, initial, variant in zip(
        runs["path"], runs["sequence"], rows["initial"], rows["variant"], strict=True
    ):
        key = (sequence, initial, variant)
        if key not in known:
            values = results.read(folder / path).details["part_distance"]
            known[key] = float(values[np.isfinite(values)][0])
        found.append(known[key])
    return found


def adaptive_rows(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of the proposed method: those of the representation that it picks (Eq. 7).

    With equal random numbers they are the same to the bit, so they are copied, not run.
    """
    picks_multi = scores["part_distance"] > scores["threshold"]
    picked = np.where(picks_multi, "multi", "single")
    return scores[scores["representation"] == picked].assign(representation="adaptive")
