"""Accuracy, robustness and expected average overlap of runs from anchors, without restarts.

These are the measures of VOT 2020 to 2022. A tracker is started at every anchor and runs to one end
of the sequence. It fails at the first of 10 frames with a target and an overlap of 0.1 or less.
Robustness is the share of frames before failures, and accuracy is their mean overlap. The first
frame counts with overlap 0, so that a perfect tracker has an accuracy of (n - 1) / n. Over
sequences, accuracy is weighted by the tracked frames and robustness by the lengths. The accuracy
on a sequence without tracked frames is 0; it is undefined if no sequence has any. The expected
average overlap is the mean, over lengths k of 115 to 754 frames, of the mean overlap of the first
k frames. The overlap is 0 after a failure. Runs whose sequence ends sooner are excluded.
Overlaps are those of rasterised regions clipped to the image; a correctly reported absence has an
overlap of 1. Kristan et al., "The eighth visual object tracking VOT2020 challenge results", ECCV
workshops 2020.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import is_well_formed
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
from trackmark.bench.metrics.sets.native import first_streak

_FAILURE_FRAMES = 10
_FAILURE_OVERLAP = 0.1
_MIN_LENGTH, _MAX_LENGTH = 115, 754


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return the scores of a run, and its curve for a data set of this run alone."""
    run = select_evaluated(truth, estimates)
    overlaps = raster_overlap(run.truth, run.estimate, run.size, run.shapes)
    reported = is_well_formed(run.estimate)
    if estimates.visible is not None:
        reported &= estimates.visible[run.frames]
    overlaps[~run.present & ~reported] = 1.0
    overlaps[0] = 0.0
    progress = first_streak((overlaps <= _FAILURE_OVERLAP) & run.present, _FAILURE_FRAMES)
    overlaps[progress:] = 0.0
    intermediate = {
        "overlaps": overlaps,  # of annotated frames
        "frames": run.frames - run.frames[0],
        "progress": np.array(progress),  # number of annotated frames before the failure
        "length": np.array(len(truth.boxes) - run.frames[0]),
        "n_sequence_frames": np.array(estimates.n_sequence_frames or len(overlaps)),
    }
    return single_run_result(combine, intermediate)


def combine(runs: ResultsBySequence) -> MetricResult:
    """Return the scores of the runs from all anchors of all sequences."""
    tracked = np.array(
        [sum(int(run.intermediate["progress"]) for run in group) for group in runs], float
    )
    frames = np.array(
        [sum(len(run.intermediate["overlaps"]) for run in group) for group in runs], float
    )
    summed = sum(float(run.intermediate["overlaps"].sum()) for group in runs for run in group)
    lengths = [int(group[0].intermediate["n_sequence_frames"]) for group in runs]
    curve, active = _expected([run for group in runs for run in group])
    averaged = slice(_MIN_LENGTH, _MAX_LENGTH + 1)
    counted = curve[averaged][active[averaged] > 0]
    # The toolkit returns 0 for one sequence without tracked frames, and divides by 0 for several.
    without_frames = 0.0 if len(runs) == 1 else np.nan
    scores = {
        "accuracy": summed / float(tracked.sum()) if tracked.any() else without_frames,
        "robustness": float(np.average(tracked / frames, weights=lengths)),
        "eao": float(counted.mean()) if len(counted) else np.nan,
        "eao_lengths": float(len(counted)),
    }
    curves = {
        "eao": np.column_stack([np.arange(len(curve)), curve])[active > 0],
        "accuracy_robustness": np.array([[scores["robustness"], scores["accuracy"]]]),
    }
    return MetricResult(scores, curves)


def _expected(runs: list[MetricResult]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean overlap of the first k frames and the number of runs, by k."""
    total, active = np.zeros(_MAX_LENGTH + 1), np.zeros(_MAX_LENGTH + 1)
    lengths = np.arange(_MAX_LENGTH + 1)
    for run in runs:
        overlaps, length = run.intermediate["overlaps"], int(run.intermediate["length"])
        inside = lengths[1:length]
        # Number of annotated frames after the first one among the first k frames.
        n_annotated = np.searchsorted(run.intermediate["frames"], inside, side="right") - 1
        sums = np.concatenate([[0.0], np.cumsum(overlaps[1:])])[n_annotated]
        total[inside] += sums / np.maximum(n_annotated, 1)
        active[inside] += n_annotated > 0
        if run.intermediate["progress"] < len(overlaps):
            beyond = lengths[max(length, 2) :]
            # The toolkit divides by one less than the number of frames.
            missing = length - len(overlaps)
            total[beyond] += overlaps[1:].sum() / (beyond - 1 - missing)
            active[beyond] += 1
    return np.divide(total, active, out=np.zeros_like(total), where=active > 0), active


METRICS = Metrics(
    metrics={
        "accuracy": Metric("mean overlap before failures", None),
        "robustness": Metric("share of frames before failures"),
        "eao": Metric("expected average overlap over 115 to 754 frames", only_overall=True),
        "eao_lengths": Metric(
            "number of the 640 lengths for which there are runs", None, None, only_overall=True
        ),
    },
    score=score_run,
    combine=combine,
    curves={
        "eao": ("frames", "expected average overlap"),
        "accuracy_robustness": ("robustness", "accuracy"),
    },
    run_kind="anchors",
    agrees_with="vot-toolkit 0.7.1 on data with runs of 755 frames or more",
)
