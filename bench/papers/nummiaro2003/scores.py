"""Stored runs of the adaptive colour particle filter and its baselines as one tidy frame."""

from collections.abc import Collection
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.ledger import ANY
from bench.papers.nummiaro2003.courses import COURSE, course_of
from bench.papers.scores import counts_of, runs_of, sequence_labels
from bench.store.layout import Cell
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = ["CELL", "TRACKER", "labels_on", "tidy_scores", "with_shared_runs"]

TRACKER = "nummiaro2003"

CELL = ("sequence", "scene", "light", "preset", "variant")
"""What a failed run costs: a scene under a reading, with and without update alike."""

_NO_VARIANT = {"preset", "model_update", "reinitialise"}
_USUAL = {"scene": 0, "light": "even", "noise": nan}
"""What is said of sequences that have no such knob."""

_SHARED = {
    "update": r"update_reading=(?!variance)\w+$",
    "reinitialisation": r"(placement|loss_frames)=\w+$",
}
"""Without this, a run is the same to the bit under variants like these. (The reading `variance`
changes the weights too.)"""


def tidy_scores(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Scores of an experiment's runs, one row a run.

    Parameters
    ----------
    folder : Path
        Results of an experiment on synthetic sequences.
    cells : collection of Cell, optional
        The runs that are meant; all by default.

    Returns
    -------
    DataFrame
        `tracker` (name alone), `preset`, `variant` (other parameters than the preset's, in text
        form; empty for none), `update` and `reinitialisation` (with, without); of baselines
        these four are `any`. `sequence` (without variant, but that a tree wider than that of the
        figures makes it another), `scene`, `light`, `noise` and further options of the
        sequence; what `bench.papers.scores.counts_of` gives, but that `frames` and `first_loss`
        count the frames alone in which the target is there; what
        `courses.course_of` gives (NaN for a failed run); `kept_scene`, true of all.

    Raises
    ------
    ResultsError
        Where a run is missing or stale.
    """
    runs = runs_of(folder, cells)
    labels = pd.DataFrame(
        [_tracker_labels(run) | labels_on(run["sequence"]) for _, run in runs.iterrows()]
    )
    rows = labels.join(counts_of(folder, runs)).assign(kept_scene=True)
    results = Results(folder)
    truths: dict[tuple[str, str], StoredTruth] = {}
    courses: list[dict[str, float]] = []
    lengths = rows[["frames", "first_loss"]].astype(float).to_numpy(copy=True)
    for i, (path, failure) in enumerate(zip(rows["path"], rows["failure"], strict=True)):
        if failure:
            courses.append(dict.fromkeys(COURSE, nan))
            continue
        run = results.read(Path(path))
        key = run.identity.sequence, run.identity.fingerprint
        if key not in truths:
            truths[key] = read_truth(folder, *key)
        courses.append(course_of(run, truths[key]))
        lengths[i] = _with_the_target(truths[key].boxes, *lengths[i])
    rows[["frames", "first_loss"]] = lengths
    scores: pd.DataFrame = rows.join(pd.DataFrame(courses, columns=list(COURSE)))
    return scores


def _with_the_target(
    boxes: NDArray[np.float64], frames: float, first_loss: float
) -> tuple[float, float]:
    """Length and frames before the loss, of the frames alone in which the target is there."""
    there = np.asarray(np.isfinite(boxes).all(axis=1))
    if first_loss >= frames:  # never
        return float(there.sum()), float(there.sum())
    return float(there.sum()), float(there[: int(first_loss)].sum())


def _tracker_labels(run: "pd.Series[Any]") -> dict[str, str]:
    name, options = parse_text(run["tracker"])
    if name != TRACKER:
        return {"tracker": name} | dict.fromkeys(
            ("preset", "variant", "update", "reinitialisation"), ANY
        )
    others = [f"{key}={value}" for key, value in options.items() if key not in _NO_VARIANT]
    return {
        "tracker": name,
        "preset": options.get("preset", "recommended"),
        "variant": ":".join(sorted(others)),
        "update": _with(options.get("model_update", "true")),
        "reinitialisation": _with(options.get("reinitialise", "true")),
    }


def _with(value: str) -> str:
    return "with" if value == "true" else "without"


def labels_on(text: str) -> dict[str, Any]:
    """Columns of `tidy_scores` that say on which sequence a run was."""
    labels = {**_USUAL, **sequence_labels(text)}
    if not isinstance(labels["light"], str):  # a cloud's share of the light, of `plain/target`
        labels["light"] = "even"
    if labels.get("tree", 1) != 1:
        labels["sequence"] = format_text(labels["sequence"], {"tree": labels["tree"]})
    return labels


def with_shared_runs(scores: pd.DataFrame) -> pd.DataFrame:
    """The scores, and runs again under every reading that makes no difference to them.

    Without update it is the same whatever an update would ask for, without re-initialisation
    whenever a target would be lost and wherever it would be looked for. Only the repetitions
    that the reading has are copied, so that it is compared with its like.
    """
    pieces = [scores]
    for column, pattern in _SHARED.items():
        without = scores[(scores[column] == "without") & (scores["variant"] == "")]
        read = scores[scores["variant"].str.match(pattern)]
        for (preset, variant), runs in read.groupby(["preset", "variant"], sort=False):
            same = without[without["preset"] == preset]
            same = same[same["repetition"].isin(runs["repetition"])]
            pieces.append(same.assign(variant=str(variant)))
    return pd.concat(pieces, ignore_index=True)
