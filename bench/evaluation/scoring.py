"""Scores of runs and of boxes, by any metrics.

A failed run is scored like a run without boxes after the initialisation. Scores of which higher is
better are 0, and the target is lost in the first frame after the initialisation. The centre error
is the diagonal of the image. If the size of the image is unknown, it is a lower bound: the diagonal
from the origin to the farthest corner of the ground truth. Other scores of which lower is better
have no upper bound: they are those of a tracker that fails as often as possible. Times have no
worst value and stay missing.
"""

from dataclasses import replace
from math import hypot, isfinite, nan
from pathlib import Path
from typing import Any, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench import protocols
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.run_record import Run, Trajectory, opened
from trackmark.bench.metrics import canonical_name, find_metrics
from trackmark.bench.metrics.interface import (
    FrameState,
    GroundTruthArrays,
    GroundTruthLike,
    MetricResult,
    RunEstimates,
    annotates_init_only,
    mean_of_sequences,
)
from trackmark.bench.protocols import ProtocolError, parse_protocol, protocol_of_key

DEFAULT_METRICS = "native"
"""Metrics whose scores are stored with every run; undefined scores are NaN."""

REVISED = "revised_"
"""Prefix of the names of scores of revised boxes."""

LATE_ESTIMATES = "late_share"
"""Score of real-time runs: share of frames after the first with an estimate of an earlier frame."""

MetricOutcome: TypeAlias = MetricResult | str
"""Result of a run by metrics, or the reason why the metrics cannot score the run."""


def score_run(
    run: Run,
    sequence: str | Path | GroundTruthLike,
    metrics: str = "native",
    trajectory: Trajectory = "online",
) -> MetricResult:
    """Return the scores and curves of a run.

    Parameters and errors are those of `score`.
    """
    if run.failure:
        raise ValueError(f"{run!r} cannot be scored: {run.failure.splitlines()[0]}")
    if trajectory not in get_args(Trajectory):
        raise ValueError(f"unknown trajectory {trajectory!r}. Known: online, revised.")
    scored = opened(sequence)
    fingerprint = getattr(scored, "fingerprint", run.identity.fingerprint)
    if fingerprint != run.identity.fingerprint:
        raise ValueError(
            f"{run!r} was made on another sequence, or on another version of this sequence. Run "
            "the tracker again."
        )
    init = select_ground_truth(scored, run.identity.init, run.identity.sequence)
    if n := int(run.metadata.get("unscored_frames", 0)):
        init = _without_last(init, n)
    definitions = find_metrics(metrics)
    if not can_score(metrics, run.identity.protocol):
        names = [
            name
            for name in protocols.names()
            if definitions.run_kind in parse_protocol(name).run_kinds
        ]
        raise ValueError(
            f"{canonical_name(metrics)} cannot score runs of the protocol "
            f"{run.identity.protocol}. It scores runs of {', '.join(names)}."
        )
    if run.states is not None and definitions.run_kind != "supervised":
        raise ValueError(f"{metrics} cannot score {run!r}: it has restarts. Use vot-supervised.")
    _check_annotation(metrics, init, run.identity.sequence)
    boxes = run.boxes_in(trajectory)
    if not run.segments:
        return definitions.score(init, RunEstimates(boxes, run.visible, run.confidence, run.states))
    segment_results, stop = [], 0
    for frames in run.segments:
        rows = slice(stop, stop := stop + len(frames))
        estimates = RunEstimates(
            boxes[rows], run.visible[rows], run.confidence[rows], n_sequence_frames=len(init.boxes)
        )
        segment_results.append(definitions.score(_select_frames(init, frames), estimates))
    return replace(definitions.combine([segment_results]), segment_results=segment_results)


def can_score(metrics: str, protocol: str) -> bool:
    """Return whether metrics can score runs by a protocol.

    No metrics can score unknown protocols, which a later version of trackmark may have stored.
    """
    try:
        rules = protocol_of_key(protocol)
    except ProtocolError:
        return False
    return find_metrics(metrics).run_kind in rules.run_kinds


def _check_annotation(metrics: str, truth: GroundTruthLike, name: str) -> None:
    """Raise `ValueError` if metrics would score the init box only; `native` scores are NaN."""
    if canonical_name(metrics) != DEFAULT_METRICS and annotates_init_only(truth):
        raise ValueError(
            f"{canonical_name(metrics)} cannot score runs on {name}: no frame after the "
            "initialisation is annotated, as in test sets. Export the results for the evaluation "
            "server of the data set."
        )


def _select_frames(truth: GroundTruthLike, frames: NDArray[Any]) -> GroundTruthArrays:
    """Return the ground truth of a segment, in the order of its frames."""
    shapes = getattr(truth, "shapes", None)
    step = -1 if frames[-1] == 0 else 1  # to an end of the sequence
    return GroundTruthArrays(
        truth.boxes[frames],
        {name: boxes[frames] for name, boxes in truth.regions.items()},
        truth.visibility[frames],
        getattr(truth, "image_size", None),
        None if shapes is None else shapes[int(frames[0]) :: step],
        annotated=np.broadcast_to(truth.annotated, len(truth.boxes))[frames],
        malformed=np.broadcast_to(truth.malformed, len(truth.boxes))[frames],
    )


def _without_last(truth: GroundTruthLike, n: int) -> GroundTruthArrays:
    """Return the ground truth with the last n frames not annotated, and thus not scored.

    Toolkits score imported results of fewer rows in this way.
    """
    frames = np.arange(len(truth.boxes))
    selected = _select_frames(truth, frames)
    return replace(selected, annotated=selected.annotated & (frames < len(frames) - n))


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


def score(
    run_or_boxes: Run | ArrayLike,
    sequence: str | Path | GroundTruthLike | None = None,
    metrics: str = "native",
    trajectory: Trajectory = "online",
) -> dict[str, float]:
    """Score a run by the ground truth that it was initialised with, or score boxes of any origin.

    Parameters
    ----------
    run_or_boxes : Run or array of float64, shape (n, 4)
        A finished run, or boxes `[x, y, width, height]` in pixels from 0, one row per frame.
    sequence : str, Path or Sequence, optional
        The sequence of the boxes; see `load_sequence`. That of a run is opened by default.
    metrics : str
        Definitions of the scores: one of `trackmark.metrics.names()`.
    trajectory : {'online', 'revised'}
        Boxes of a run to score: as returned by each update, or with the tracker's corrections.

    Returns
    -------
    dict of str to float
        Scores of the metrics. For online boxes of runs with masks, also
        `bench.metrics.regions.segmentation_scores`.

    Raises
    ------
    TypeError
        For an object that is neither a run nor boxes, and for boxes without a sequence.
    ValueError
        For a failed run, unknown metrics or an unknown trajectory, another sequence, or a run that
        the metrics cannot score.

    Examples
    --------
    >>> from trackmark import datasets
    >>> truth = datasets.load("samples/face")
    >>> score(truth.boxes, truth)["mean_overlap"]
    1.0
    """
    if not isinstance(run_or_boxes, Run):
        if sequence is None:
            raise TypeError("the sequence of the boxes is missing. Give its name or a Sequence.")
        try:
            boxes = np.asarray(run_or_boxes, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(
                f"{type(run_or_boxes).__name__} is neither a run nor boxes. Expected: a run, for "
                "example results['static', 'face'], or an array of shape (n, 4)."
            ) from None
        truth = opened(sequence)
        _check_annotation(metrics, truth, getattr(truth, "name", "the sequence"))
        return dict(find_metrics(metrics).score(truth, RunEstimates(boxes)).scores)
    run = run_or_boxes
    sequence = run.open_sequence() if sequence is None else sequence
    scores = dict(score_run(run, sequence, metrics, trajectory).scores)
    if run.segmentation is not None and trajectory == "online":
        from trackmark.bench.metrics.regions import segmentation_scores  # loads OpenCV

        initialised = int(np.flatnonzero(np.isfinite(run.boxes[:, 0]))[0])
        scores |= segmentation_scores(run.segmentation, initialised)
    return scores


def score_both(run: Run, sequence: str | GroundTruthLike) -> dict[str, float]:
    """Return the `native` scores of the online boxes and, if any, of the revised boxes.

    Names of scores of revised boxes start with `REVISED`. The result is empty for a run that
    `native` cannot score. Parameters and errors are those of `score`.
    """
    if run.failure or run.states is not None or not can_score("native", run.identity.protocol):
        return {}
    scores = score(run, sequence)
    if run.revised is None or run.times is not None:
        return scores
    revised = score(run, sequence, trajectory="revised")
    return scores | {REVISED + name: value for name, value in revised.items()}
