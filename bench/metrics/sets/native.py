"""Scores that follow no toolkit; a perfect tracker scores 1.

The frames with a target after the initialisation are evaluated. Absent frames and frames without
annotation are neither hits nor misses. A malformed box is a miss: overlap 0, centre error infinite.
Overlaps are those of exact boxes, and success is an overlap of 0.5 or more. Whether the centre is
inside and whether the target is lost refer to the region `full`, the whole object, if there is one.
Unknown visibility counts as visible. All sequences have equal weights. No toolkit computes the same
scores.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import centre_error, centre_inside, is_well_formed, overlap
from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    RunEstimates,
    select_evaluated,
)

SUCCESS_OVERLAP = 0.5
"""Minimum overlap of a success."""

LOSS_FRAMES = 10
"""Number of consecutive visible frames with the centre outside the box after which the target
counts as lost.
"""

VISIBLE_FRACTION = 0.3
"""Minimum visible fraction of the target in a frame that can contribute to a loss."""


def first_loss(
    inside: NDArray[np.bool_], evaluated: NDArray[np.bool_], visibility: NDArray[np.float64]
) -> int:
    """Return the frame from which the target is lost; n if it is never lost.

    This is the first of `LOSS_FRAMES` consecutive visible frames in which the estimated centre is
    outside the box. A frame counts as visible if it is evaluated, and if `VISIBLE_FRACTION` of the
    target or an unknown fraction is visible; other frames are skipped. All arguments have shape
    (n,).
    """
    counted = np.flatnonzero(evaluated & ~(visibility < VISIBLE_FRACTION))
    start = first_streak(~inside[counted], LOSS_FRAMES)
    return int(counted[start]) if start < len(counted) else len(inside)


def first_streak(flags: NDArray[np.bool_], length: int) -> int:
    """Return the index of the first `length` consecutive true flags; `len(flags)` if none."""
    if len(flags) < length:
        return len(flags)
    streaks = np.lib.stride_tricks.sliding_window_view(flags, length).all(axis=1)
    return int(streaks.argmax()) if streaks.any() else len(flags)


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return the scores of a run; there are no thresholds and thus no curves.

    Without `estimates.visible`, `absence_reported` is NaN.
    """
    run = select_evaluated(truth, estimates)
    evaluated, absent = run.present.copy(), ~run.present
    evaluated[0] = False
    t, e = run.truth[evaluated], run.estimate[evaluated]
    overlaps, errors = overlap(t, e), centre_error(t, e)
    whole_object = truth.regions.get("full", truth.boxes)[run.frames]
    inside = centre_inside(whole_object, run.estimate)
    visibility = np.broadcast_to(truth.visibility, len(truth.boxes))[run.frames]
    frames = [*run.frames.tolist(), len(truth.boxes)]
    visible = None if estimates.visible is None else estimates.visible[run.frames]
    scores = {
        "evaluated_frames": float(evaluated.sum()),
        "mean_overlap": _mean(overlaps),
        "success_frames": float((overlaps >= SUCCESS_OVERLAP).sum()),
        "success_rate": _mean(overlaps >= SUCCESS_OVERLAP),
        "inside_frames": float((inside & evaluated).sum()),
        "inside_rate": _mean(inside[evaluated]),
        "first_loss": float(frames[first_loss(inside, evaluated, visibility)]),
        "centre_error": _mean(errors),
        "centre_error_median": _quantile(errors, 0.5),
        "centre_error_p90": _quantile(errors, 0.9),
        "normalised_centre_error": _mean(errors / np.hypot(t[:, 2], t[:, 3])),
        "malformed_boxes": float((~is_well_formed(e)).sum()),
        "absent_frames": float(absent.sum()),
        "absence_reported": np.nan if visible is None else _mean(~visible[absent]),
    }
    return MetricResult(scores, {})


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _quantile(values: NDArray[np.float64], q: float) -> float:
    """Return a quantile by linear interpolation; infinite if an interpolated value is infinite."""
    if not len(values):
        return np.nan
    ordered = np.sort(values)
    position = q * (len(values) - 1)
    below = int(position)
    weight = position - below
    if weight == 0.0:
        return float(ordered[below])
    upper = ordered[below + 1]
    return float((1 - weight) * ordered[below] + weight * upper) if np.isfinite(upper) else np.inf


METRICS = Metrics(
    undefined="no annotated frame after the first has a target",
    metrics={
        "evaluated_frames": Metric("evaluated frames", None, None),
        "mean_overlap": Metric("mean overlap, the area under the exact success curve"),
        "success_frames": Metric("frames with an overlap of 0.5 or more", None),
        "success_rate": Metric("share of frames with an overlap of 0.5 or more"),
        "inside_frames": Metric("frames with the estimated centre in the ground-truth box", None),
        "inside_rate": Metric("share of frames with the centre in the ground-truth box"),
        "first_loss": Metric(
            "first of 10 consecutive visible frames with the centre outside", None
        ),
        "centre_error": Metric("mean distance of the centres [px]", 0.0, "lower"),
        "centre_error_median": Metric("median distance of the centres [px]", 0.0, "lower"),
        "centre_error_p90": Metric("90th percentile of the distance [px]", 0.0, "lower"),
        "normalised_centre_error": Metric(
            "mean distance of the centres [diagonals of the box]", 0.0, "lower"
        ),
        "malformed_boxes": Metric("frames with a malformed box", 0.0, "lower"),
        "absent_frames": Metric("frames without target", None, None),
        "absence_reported": Metric(
            "share of the frames without target in which its absence is reported", None
        ),
    },
    score=score_run,
)
