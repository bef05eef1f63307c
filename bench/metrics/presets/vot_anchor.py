"""Accuracy, robustness and expected average overlap of runs from many anchors, without restarts.

The measures of VOT 2020 to 2022. A tracker is started at every anchor and runs to an end of the
sequence. It fails at the first of 10 frames with an overlap of 0.1 or less in which there is a
target. Robustness is the share of frames before failures, accuracy their mean overlap; the given
first frame counts with overlap 0, so that a perfect tracker has an accuracy of (n - 1) / n. All
sequences have means weighted by the frames tracked (accuracy) and by their lengths (robustness).
The expected average overlap is the mean over lengths of 115 to 754 frames of the mean overlap of
that many frames: zero after a failure, and without the runs that end sooner with the sequence.
Overlap is that of rasterised regions, cut off at the image; an absent target that is reported as
such overlaps by 1. Kristan et al., "The eighth visual object tracking VOT2020 challenge results",
ECCV workshops 2020.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import Truth, first_streak
from trackmark.bench.metrics.overlap import is_well_formed
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

_GRACE = 10
_FAILED = 0.1
_SHORTEST, _LONGEST = 115, 754


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return the scores of a run, and its curve for a data set of this run alone."""
    run = started(truth, answer)
    overlaps = raster_overlap(run.truth, run.estimate, run.size, run.shapes)
    seen = is_well_formed(run.estimate)
    if answer.visible is not None:
        seen &= answer.visible[run.frames]
    overlaps[~run.present & ~seen] = 1.0
    overlaps[0] = 0.0
    progress = first_streak((overlaps <= _FAILED) & run.present, _GRACE)  # frames before failure
    overlaps[progress:] = 0.0
    evidence = {
        "overlaps": overlaps,
        "progress": np.array(progress),
        "of": np.array(answer.of or len(overlaps)),
    }
    return alone(combine, evidence)


def combine(runs: Runs) -> Judged:
    """Return the scores of the runs from all anchors of all sequences."""
    tracked = np.array([sum(int(run.evidence["progress"]) for run in of) for of in runs], float)
    frames = np.array([sum(len(run.evidence["overlaps"]) for run in of) for of in runs], float)
    summed = sum(float(run.evidence["overlaps"].sum()) for of in runs for run in of)
    lengths = [int(of[0].evidence["of"]) for of in runs]
    curve, active = _expected([run for of in runs for run in of])
    part = slice(_SHORTEST, _LONGEST + 1)
    counted = curve[part][active[part] > 0]
    scores = {
        "accuracy": summed / float(tracked.sum()) if tracked.any() else 0.0,
        "robustness": float(np.average(tracked / frames, weights=lengths)),
        "eao": float(counted.mean()) if len(counted) else np.nan,
        "eao_lengths": float(len(counted)),
    }
    curves = {
        "eao": np.column_stack([np.arange(len(curve)), curve])[active > 0],
        "accuracy_robustness": np.array([[scores["robustness"], scores["accuracy"]]]),
    }
    return Judged(scores, curves)


def _expected(runs: list[Judged]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean overlap of the first frames by their number, and the number of runs."""
    total, active = np.zeros(_LONGEST + 1), np.zeros(_LONGEST + 1)
    numbers = np.arange(_LONGEST + 1)
    for run in runs:
        overlaps = run.evidence["overlaps"]
        inside = numbers[1 : len(overlaps)]
        sums = np.cumsum(overlaps[1 : len(inside) + 1])
        total[inside] += sums / inside
        active[inside] += 1
        if run.evidence["progress"] < len(overlaps):
            beyond = numbers[max(len(overlaps), 2) :]
            # One less than the number of frames, as the toolkit has it.
            total[beyond] += overlaps[1:].sum() / (beyond - 1)
            active[beyond] += 1
    return np.divide(total, active, out=np.zeros_like(total), where=active > 0), active


PRESET = Preset(
    columns={
        "accuracy": Column("mean overlap before failures", None),
        "robustness": Column("share of frames before failures"),
        "eao": Column("expected average overlap over 115 to 754 frames", whole=True),
        "eao_lengths": Column("of these 640 lengths those that occur", None, None, whole=True),
    },
    judge=judge,
    combine=combine,
    curves={
        "eao": Axes("frames", "expected average overlap"),
        "accuracy_robustness": Axes("robustness", "accuracy"),
    },
    protocol="anchors",
    agrees="vot-toolkit 0.7.1 on data of which runs have 755 frames or more",
)
