"""Precision, recall and F of trackers that say how sure they are that the target is there.

A frame counts as reported where the tracker says that it sees the target and its confidence reaches
a threshold. Precision is the mean overlap over the frames reported, recall the sum of their
overlaps over the number of frames with a target, F the harmonic mean of the two, at the threshold
at which F is greatest; precision and recall are averaged over sequences before. Thresholds are 100
at most, taken from the tracker's own confidences. A frame without confidence has confidence 0, and
so has the given first one, which counts with overlap 0: a perfect tracker scores a little less than
1. Overlap is that of rasterised regions, cut off at the image. Lukežič et al., "Now you see me:
evaluating performance in long-term visual tracking", 2018; the measure of VOT's long-term
challenges.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.preset import (
    Answer,
    Axes,
    Column,
    Judged,
    Preset,
    Runs,
    alone,
    started,
)
from trackmark.bench.metrics.region_overlap import raster_overlap

_THRESHOLDS = 98  # and two that all and none reach


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return the scores of a run, and its curves for a data set of this run alone."""
    run = started(truth, answer)
    n = len(run.truth)
    overlaps = raster_overlap(run.truth, run.estimate, run.size, run.shapes)
    confidence = np.zeros(n)
    if answer.confidence is not None:
        confidence = np.nan_to_num(np.asarray(answer.confidence, np.float64)[run.frames])
    reported = np.ones(n, bool) if answer.visible is None else answer.visible[run.frames].copy()
    overlaps[0], confidence[0], reported[0] = 0.0, 0.0, True
    evidence = {
        "overlaps": overlaps[reported],
        "confidence": confidence[reported],
        "present": np.array(run.present.sum()),
    }
    return alone(combine, evidence)


def combine(runs: Runs) -> Judged:
    """Return the scores of the runs on all sequences, at one threshold."""
    thresholds = _thresholds([run.evidence["confidence"] for of in runs for run in of])
    curves = [np.mean([_precision_recall(run, thresholds) for run in of], axis=0) for of in runs]
    precision, recall = np.mean(curves, axis=0).T
    both = precision + recall
    f = np.divide(2 * precision * recall, both, out=np.zeros_like(both), where=both > 0)
    best = int(f.argmax())
    scores = {
        "precision": float(precision[best]),
        "recall": float(recall[best]),
        "f": float(f[best]),
    }
    drawn = {
        "precision_recall": np.column_stack([recall, precision]),
        "f": np.column_stack([np.linspace(0, 1, len(f)), f]),
    }
    return Judged(scores, drawn)


def _thresholds(confidence: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return confidences at equal distances in their order, the greatest first."""
    ordered = np.sort(np.concatenate(confidence))[::-1]
    if len(ordered) > _THRESHOLDS:
        step = len(ordered) // _THRESHOLDS
        places = np.round(np.linspace(step, len(ordered) - step, _THRESHOLDS))
        ordered = ordered[places.astype(int)]
    return np.concatenate([[np.inf], ordered, [-np.inf]])


def _precision_recall(run: Judged, thresholds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return precision and recall by threshold, shape (thresholds, 2)."""
    order = np.argsort(-run.evidence["confidence"], kind="stable")
    sums = np.concatenate([[0.0], np.cumsum(run.evidence["overlaps"][order])])
    reached = np.searchsorted(-run.evidence["confidence"][order], -thresholds, side="right")
    precision = np.divide(sums[reached], reached, out=np.ones(len(reached)), where=reached > 0)
    return np.column_stack([precision, sums[reached] / run.evidence["present"]])


PRESET = Preset(
    columns={
        "precision": Column("mean overlap over the frames reported", None),
        "recall": Column("overlap over the frames with a target", None),
        "f": Column("harmonic mean of the two", None),
    },
    judge=judge,
    combine=combine,
    curves={
        "precision_recall": Axes("recall", "precision"),
        "f": Axes("share of the thresholds", "F"),
    },
    agrees="vot-toolkit 0.7.1",
)
