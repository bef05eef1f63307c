"""Scores of a run by any metrics, also of a failed run and of a run that they cannot score.

A failed run is scored like a run without boxes after the initialisation. Scores of which higher is
better are 0, and the target is lost in the first frame after the initialisation. The centre error
is the diagonal of the image. If the size of the image is unknown, it is a lower bound: the diagonal
from the origin to the farthest corner of the ground truth. Other scores of which lower is better
have no upper bound: they are those of a tracker that fails as often as possible. Times have no
worst value and stay missing.
"""

from dataclasses import replace
from math import hypot, isfinite, nan
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import score_run
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import (
    FrameState,
    MetricResult,
    annotates_init_only,
    mean_of_sequences,
)
from trackmark.bench.protocols import parse_protocol

LATE_ESTIMATES = "late_share"
"""Score of real-time runs: share of frames after the first with an estimate of an earlier frame."""

MetricOutcome: TypeAlias = MetricResult | str
"""Result of a run by metrics, or the reason why the metrics cannot score the run."""


def outcome_of(run: Run, truth: Any, metrics: str) -> MetricOutcome:
    """Return the scores of a run, the worst ones if it failed, or why it cannot be scored.

    Runs whose estimates can be late have the additional score `LATE_ESTIMATES`.
    """
    try:
        if run.failure:
            return worst_result(run, truth, metrics)
        result = score_run(run, truth, metrics)
    except ValueError as error:  # raised by metrics that cannot score the run
        return str(error)
    if run.estimate_frames is None:
        return result
    frames = np.flatnonzero(run.estimate_frames >= 0)[1:]
    late = float(np.mean(run.estimate_frames[frames] != frames)) if len(frames) else nan
    return replace(result, scores={**result.scores, LATE_ESTIMATES: late})


def worst_result(run: Run, truth: Any, metrics: str) -> MetricResult:
    """Return the worst possible scores of a run.

    Raises `ValueError` if the metrics cannot score runs by the run's protocol.
    """
    result, definition = score_run(_lost_run(run), truth, metrics), find_metrics(metrics)
    if annotates_init_only(truth):  # the scores of finished runs are undefined, too
        return result
    present = np.isfinite(truth.boxes).all(axis=1)
    diagonal = _diagonal(truth)
    scores, curves = dict(result.scores), result.curves
    for name, metric in definition.metrics.items():
        if metric.direction == "higher":
            scores[name] = 0.0
        elif metric.direction == "lower" and not isfinite(scores[name]):  # a centre error
            scores[name] = diagonal
    if "first_loss" in scores:
        scores["first_loss"] = float(np.argmax(present)) + 1
    if "normalised_centre_error" in scores:
        sizes = np.hypot(*truth.boxes[present][1:, 2:].T)
        scores["normalised_centre_error"] = float(np.mean(diagonal / sizes))
    if definition.combine is mean_of_sequences:  # other metrics compute curves from the evidence
        curves = {name: np.column_stack([c[:, 0], 0 * c[:, 1]]) for name, c in curves.items()}
    return replace(result, scores=scores, curves=curves)


def _lost_run(run: Run) -> Run:
    """Return a run without boxes; in a supervised run, each restart is followed by a failure."""
    n = len(run.boxes)
    states: NDArray[np.int32] | None = None
    if run.states is not None:
        skipped = max(getattr(parse_protocol(run.identity.protocol), "skip_frames", 1), 1) - 1
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
        estimate_frames=None,
        states=states,
    )


def _diagonal(truth: Any) -> float:
    """Return the diagonal of the image [px], or a lower bound from the ground truth."""
    if truth.image_size is not None:
        return hypot(*truth.image_size)
    corners = truth.boxes[:, :2] + truth.boxes[:, 2:]
    return hypot(*np.nanmax(corners, axis=0))
