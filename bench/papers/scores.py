"""What the scores of every paper's runs have in common: one row a run."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import datasets
from bench.store.files import ResultsError
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from datasets.text_form import format_text, parse_text

__all__ = [
    "canonical_name",
    "counts_of",
    "runs_of",
    "sequence_labels",
    "without_failures",
]

_SCORES = ("success_frames", "frames_inside", "first_loss", "mean_overlap")


def runs_of(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Runs of an experiment, finished or failed; see `bench.store.loading.load_results`.

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
    return runs


def counts_of(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """What is known of every run.

    Parameters
    ----------
    folder : Path
        Results of the experiment.
    runs : DataFrame
        See `runs_of`.

    Returns
    -------
    DataFrame
        `repetition`, `frames` (length with the given first frame), `success_frames`,
        `frames_inside` (both count the given frame), `first_loss` (frames before the loss),
        `mean_overlap`, `path`, `failure` (a line that names the run and says why it failed;
        such a run has no scores; empty for others).
    """
    scores = {name: runs.get(name, pd.Series(np.nan, runs.index)).to_numpy() for name in _SCORES}
    cells = runs[["tracker", "sequence", "repetition", "protocol"]]
    return pd.DataFrame(
        {
            "repetition": runs["repetition"].to_numpy(),
            "frames": runs["frames"].to_numpy(np.int64),
            "success_frames": scores["success_frames"] + 1,
            "frames_inside": scores["frames_inside"] + 1,
            "first_loss": scores["first_loss"],
            "mean_overlap": scores["mean_overlap"],
            "path": [str(folder / run_path(*cell)) for cell in cells.itertuples(index=False)],
            "failure": [_failure(run) for _, run in runs.iterrows()],
        }
    )


def _failure(run: "pd.Series[Any]") -> str:
    if not run["failure"]:
        return ""
    reason = str(run["failure"]).partition("\n")[0]
    return f"{run['tracker']} on {run['sequence']}, repetition {run['repetition']}: {reason}"


def sequence_labels(text: str) -> dict[str, Any]:
    """Name of a synthetic sequence without variant (`sequence`), and its knobs by name."""
    name, variant = parse_text(text)
    knobs = {
        knob["name"]: type(knob["default"])(variant.get(knob["name"], knob["default"]))
        for knob in datasets.options(name)
    }
    return {"sequence": name, **knobs}


def canonical_name(row: "pd.Series[Any]") -> str:
    """Name of the sequence of a row of scores, with what of its variant is no default."""
    options = {
        knob["name"]: row[knob["name"]]
        for knob in datasets.options(row["sequence"])
        if row[knob["name"]] != knob["default"]
    }
    return format_text(row["sequence"], dict(sorted(options.items())))


def without_failures(scores: pd.DataFrame, cell: Sequence[str]) -> pd.DataFrame:
    """Runs of those cells alone in which no run failed.

    Left in a cell, the other repetitions would stand for the failed one, and what it is
    compared with would be compared with nothing.

    Parameters
    ----------
    scores : DataFrame
        A row a run, with `failure`.
    cell : sequence of str
        Columns that say which cell a run belongs to.
    """
    cells = scores[list(cell)]
    failed = cells[scores["failure"] != ""].drop_duplicates()
    if failed.empty:
        return scores
    side = cells.merge(failed, "left", indicator="side")["side"]
    return scores[(side == "left_only").to_numpy()]
