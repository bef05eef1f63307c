"""Success and precision as defined by the OTB benchmark; a perfect tracker scores 0.952.

The success plot shows the share of frames with an overlap above each of 21 thresholds (0, 0.05, …,
1). The score is its mean: no overlap is above 1, so the best score is 20/21. Precision is the share
of frames with centres at most 20 px apart. Distances are first rounded to 4 decimals, as in
jwlim/tracker_benchmark: 20.00004 is a hit. All frames from the initialisation on count, and the
first estimate is replaced by the ground truth. Absent frames and malformed boxes are misses. All
sequences have equal weights. Wu, Lim, Yang, "Object Tracking Benchmark", TPAMI 2015.
"""

import numpy as np

from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.metrics.curves import DISTANCES, OVERLAPS, share_curve
from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    RunEstimates,
    select_evaluated,
)

_INDEX_OF_20_PIXELS = 20
_INDEX_OF_HALF = 10
# Largest numbers that are at most a threshold after rounding to 4 decimals. Python rounds like the
# toolkit; NumPy multiplies first and differs at ties.
_TIES = [(k, k + 0.5e-4) for k in DISTANCES.tolist()]
_LIMITS = np.array([x if round(x, 4) <= k else np.nextafter(x, 0) for k, x in _TIES])


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return scores and curves of a run."""
    run = select_evaluated(truth, estimates)
    t, e, n = run.truth, run.estimate, len(run.truth)
    overlaps = np.where(run.present, overlap(t, e), 0.0)
    success = share_curve(overlaps, OVERLAPS, above=True)
    precision = share_curve(centre_error(t, e), _LIMITS)
    precision[:, 0] = DISTANCES
    scores = {
        "success_auc": float(success[:, 1].mean()),
        "precision": float(precision[_INDEX_OF_20_PIXELS, 1]),
        "success_rate": float(success[_INDEX_OF_HALF, 1]),
        "mean_overlap": float(overlaps.mean()),
        "success_published": float(np.count_nonzero(overlaps >= OVERLAPS[_INDEX_OF_HALF]) / n),
    }
    return MetricResult(scores, {"success": success, "precision": precision})


METRICS = Metrics(
    metrics={
        "success_auc": Metric("mean of the success curve over 21 thresholds", 20 / 21),
        "precision": Metric("share of frames with centres at most 20 px apart"),
        "success_rate": Metric("share of frames with an overlap above 0.5"),
        "mean_overlap": Metric("mean overlap over all frames, as published with the plots"),
        "success_published": Metric("share of frames with an overlap of 0.5 or more, as published"),
    },
    score=score_run,
    curves={
        "success": ("overlap threshold", "share of frames"),
        "precision": ("centre distance [px]", "share of frames"),
    },
    agrees_with="the OTB toolkits (MATLAB, jwlim/tracker_benchmark) and got10k's ExperimentOTB",
    aliases=("otb100-auc",),
)
