"""Precision, recall and F-score of trackers that report confidences and target absence.

A frame is reported if the tracker reports the target as visible and its confidence reaches a
threshold. Precision is the mean overlap over the reported frames. Recall is the sum of their
overlaps divided by the number of frames with a target. Frames that are not annotated do not count.
Precision and recall are averaged over
sequences. F is their harmonic mean at the threshold with the largest F. There are at most 100
thresholds, taken from the confidences of the tracker. A missing confidence counts as 0. The first
frame counts with confidence 0 and overlap 0: a perfect tracker scores a little less than 1. A run
of one frame has no scores and is left out of the means.
Overlaps are those of rasterised regions clipped to the image. Lukežič et al., "Now you see me:
evaluating performance in long-term visual tracking", 2018; the measure of the long-term challenges
of VOT.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    ResultsBySequence,
    RunEstimates,
    select_evaluated,
    single_run_result,
)
from trackmark.bench.metrics.region_overlap import raster_overlap

_MAX_THRESHOLDS = 98  # in addition to plus and minus infinity


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return the scores of a run, and its curves for a data set of this run alone."""
    run = select_evaluated(truth, estimates)
    n = len(run.truth)
    overlaps = raster_overlap(run.truth, run.estimate, run.size, run.shapes)
    confidence = np.zeros(n)
    if estimates.confidence is not None:
        confidence = np.nan_to_num(np.asarray(estimates.confidence, np.float64)[run.frames])
    reported = (
        np.ones(n, bool) if estimates.visible is None else estimates.visible[run.frames].copy()
    )
    overlaps[0], confidence[0], reported[0] = 0.0, 0.0, True
    intermediate = {
        "overlaps": overlaps[reported],
        "confidence": confidence[reported],
        "present": np.array(run.present.sum()),
        "frames": np.array(n),
    }
    return single_run_result(combine, intermediate)


def combine(runs: ResultsBySequence) -> MetricResult:
    """Return the scores of the runs on all sequences at a common threshold.

    Scores are undefined if no run has a second frame: F is 0 / 0 at every threshold.
    """
    runs = [[run for run in group if run.intermediate["frames"] > 1] for group in runs]
    runs = [group for group in runs if group]
    if not runs:
        return MetricResult(dict.fromkeys(METRICS.metrics, np.nan), {})
    thresholds = _thresholds([run.intermediate["confidence"] for group in runs for run in group])
    curves = [
        np.mean([_precision_recall(run, thresholds) for run in group], axis=0) for group in runs
    ]
    precision, recall = np.mean(curves, axis=0).T
    both = precision + recall
    f = np.divide(2 * precision * recall, both, out=np.zeros_like(both), where=both > 0)
    best = int(f.argmax())
    scores = {
        "precision": float(precision[best]),
        "recall": float(recall[best]),
        "f": float(f[best]),
    }
    plots = {
        "precision_recall": np.column_stack([recall, precision]),
        "f": np.column_stack([np.linspace(0, 1, len(f)), f]),
    }
    return MetricResult(scores, plots)


def _thresholds(confidence: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return equally spaced elements of the confidences, sorted from the largest."""
    ordered = np.sort(np.concatenate(confidence))[::-1]
    if len(ordered) > _MAX_THRESHOLDS:
        step = len(ordered) // _MAX_THRESHOLDS
        indices = np.round(np.linspace(step, len(ordered) - step, _MAX_THRESHOLDS))
        ordered = ordered[indices.astype(int)]
    return np.concatenate([[np.inf], ordered, [-np.inf]])


def _precision_recall(run: MetricResult, thresholds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return precision and recall by threshold, shape (thresholds, 2)."""
    order = np.argsort(-run.intermediate["confidence"], kind="stable")
    sums = np.concatenate([[0.0], np.cumsum(run.intermediate["overlaps"][order])])
    reached = np.searchsorted(-run.intermediate["confidence"][order], -thresholds, side="right")
    precision = np.divide(sums[reached], reached, out=np.ones(len(reached)), where=reached > 0)
    return np.column_stack([precision, sums[reached] / run.intermediate["present"]])


METRICS = Metrics(
    metrics={
        "precision": Metric("mean overlap over the reported frames", None),
        "recall": Metric("sum of these overlaps / number of frames with a target", None),
        "f": Metric("harmonic mean of precision and recall", None),
    },
    score=score_run,
    combine=combine,
    curves={
        "precision_recall": ("recall", "precision"),
        "f": ("share of the thresholds", "F"),
    },
    agrees_with="vot-toolkit 0.7.1",
)
