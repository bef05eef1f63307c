"""Worst scores for failed runs, and notes on them.

A failed run is scored like a run without boxes after the initialisation. Scores of which higher is
better are 0, and the target is lost in the first frame after the initialisation. The centre error
is the diagonal of the image. If the size of the image is unknown, it is a lower bound: the diagonal
from the origin to the farthest corner of the ground truth. Other scores of which lower is better
have no upper bound: they are those of a tracker that fails as often as possible. Scores of masks
are 0. Times have no worst value and stay missing.
"""

from contextlib import suppress
from dataclasses import replace
from math import hypot, isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import score_run
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import (
    FrameState,
    PresetResult,
    annotates_init_only,
    mean_of_sequences,
)
from trackmark.bench.protocols import TIMING, parse_protocol
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, read_truth
from trackmark.reports.tables import failure_notes


class FailedRuns(NamedTuple):
    """Failed runs of a comparison or table."""

    notes: dict[str, str]  # by tracker: number of failed runs, and reason of the first failure
    left_out: list[str]  # trackers whose runs all failed


def failed_runs(runs: pd.DataFrame, counted: str = "the worst score") -> FailedRuns:
    """Return notes on the trackers with failed runs, for runs by one protocol.

    `counted`: score of a failed run in the notes, for example `0` for an overlap.

    >>> runs = pd.DataFrame({"tracker": ["a", "a"], "sequence": ["cup", "box"]})
    >>> runs = runs.assign(status=["failed", "finished"], failure=["frame 3: ValueError: no", ""])
    >>> failed_runs(runs, "0").notes
    {'a': '1 of 2 runs failed (counted as 0): sequence cup, ValueError: no'}
    """
    notes = failure_notes(runs, counted)
    succeeded = set(runs["tracker"][runs["status"] != "failed"])
    return FailedRuns(notes, [tracker for tracker in notes if tracker not in succeeded])


def with_worst_scores(folder: Path, runs: pd.DataFrame, preset: str = "native") -> pd.DataFrame:
    """Return runs with the worst scores of a metrics preset in failed rows.

    The status stays `failed`. Timing runs, runs of trackers whose runs all failed, and runs that
    the preset cannot score are unchanged. `runs`: as `load_runs` or `runs_by` return them; their
    ground truth is read from the results `folder`. Raises `ResultsError` if a file is missing or
    damaged.
    """
    keys = pd.MultiIndex.from_frame(runs[["tracker", "protocol"]].astype(str))
    is_failed = (runs["status"] == "failed").to_numpy()
    failed = runs[is_failed & keys.isin(keys[~is_failed]) & (runs["protocol"] != TIMING)]
    if failed.empty:
        return runs
    filled, results = runs.copy(), Results(folder)
    for number, row in zip(failed.index, failed.to_dict("records"), strict=True):
        run = results.read(run_key(row))
        truth = read_truth(folder, row["sequence"], row["fingerprint"])
        scores: dict[str, float] = {}
        with suppress(ValueError):  # the preset cannot score such runs
            scores |= judge_failed(run, truth, preset).scores
        masks = runs.filter(regex="region|contour")[runs["tracker"] == row["tracker"]]
        scores |= dict.fromkeys(masks.columns[masks.notna().any()], 0.0)
        for column, value in scores.items():
            filled.loc[number, column] = value
    return filled


def judge_failed(run: Run, truth: StoredTruth, preset: str) -> PresetResult:
    """Return the worst possible scores of a run by a metrics preset.

    Raises `ValueError` if the preset cannot score runs by the run's protocol.
    """
    judged, definition = score_run(_lost_run(run), truth, preset), metrics_preset(preset)
    if annotates_init_only(truth):  # the scores of finished runs are undefined, too
        return judged
    present = np.isfinite(truth.boxes).all(axis=1)
    diagonal = _diagonal(truth)
    scores, curves = dict(judged.scores), judged.curves
    for name, column in definition.columns.items():
        if column.better == "higher":
            scores[name] = 0.0
        elif column.better == "lower" and not isfinite(scores[name]):  # a centre error
            scores[name] = diagonal
    if "first_loss" in scores:
        scores["first_loss"] = float(np.argmax(present)) + 1
    if "normalised_centre_error" in scores:
        sizes = np.hypot(*truth.boxes[present][1:, 2:].T)
        scores["normalised_centre_error"] = float(np.mean(diagonal / sizes))
    if definition.combine is mean_of_sequences:  # other presets compute curves from the evidence
        curves = {name: np.column_stack([c[:, 0], 0 * c[:, 1]]) for name, c in curves.items()}
    return replace(judged, scores=scores, curves=curves)


def _lost_run(run: Run) -> Run:
    """Return a run without boxes; in a supervised run, each restart is followed by a failure."""
    n = len(run.boxes)
    states: NDArray[np.int32] | None = None
    if run.states is not None:
        skipped = max(getattr(parse_protocol(run.identity.protocol), "skip", 1), 1) - 1
        cycle = [FrameState.INITIALISED, FrameState.FAILED] + [FrameState.SKIPPED] * skipped
        first = int(np.argmax(run.states == FrameState.INITIALISED))
        states = np.full(n, FrameState.SKIPPED, np.int32)
        states[first:] = np.resize(cycle, n - first)
    return replace(
        run,
        failure="",
        boxes=np.full((n, 4), nan),
        visible=np.ones(n, np.bool_),
        confidence=np.full(n, nan),
        revised=None,
        segmentation=None,
        source_frames=None,
        states=states,
    )


def _diagonal(truth: StoredTruth) -> float:
    """Return the diagonal of the image [px], or a lower bound from the ground truth."""
    if truth.image_size is not None:
        return hypot(*truth.image_size)
    corners = truth.boxes[:, :2] + truth.boxes[:, 2:]
    return hypot(*np.nanmax(corners, axis=0))
