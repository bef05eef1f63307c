"""Areas under success, precision and normalised precision as defined by the TrackingNet devkit.

Boxes are rounded to whole pixels, halves to even numbers. The curves have 21 thresholds: overlaps
of at least 0 to 1, and centre errors up to 0 to 50 px or 0 to 0.5 widths and heights of the ground
truth. (Before its commit 967661d, the devkit counted overlaps above the thresholds.) Scores are
areas by the trapezoid rule as a share of the threshold range. A lost frame counts at threshold 0: a
tracker without any overlap has a success of 0.025. Unlike in the devkit, scores are shares, not per
cent. The first frame counts, and its estimate is replaced by the ground truth. Frames without
target are misses at every threshold. Malformed boxes have an overlap of 0 and are misses for
precision. All sequences have equal weights. Müller et al., "TrackingNet: a large-scale dataset and
benchmark for object tracking in the wild", ECCV 2018.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import is_well_formed, overlap
from trackmark.bench.metrics.curves import OVERLAPS, share_curve
from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    RunEstimates,
    select_evaluated,
)

_PIXELS = np.linspace(0, 50, 21)
_SIZES = np.linspace(0, 0.5, 21)


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return scores and curves of a run."""
    run = select_evaluated(truth, estimates)
    # A box whose size is rounded to 0 is well-formed: it has a centre.
    e = np.where(is_well_formed(run.estimate)[:, None], np.round(run.estimate), np.nan)
    t = np.round(run.truth)
    success = share_curve(-overlap(t, e), -OVERLAPS)  # at or above each threshold
    success[:, 0] = OVERLAPS
    curves = {
        "success": success,
        "precision": share_curve(_centre_errors(t, e, 1.0), _PIXELS),
        "normalised_precision": share_curve(_centre_errors(t, e, t[:, 2:]), _SIZES),
    }
    scores = {f"{name}_auc": float(np.trapezoid(c[:, 1], OVERLAPS)) for name, c in curves.items()}
    return MetricResult(scores, curves)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # coordinates of 1e308
def _centre_errors(
    truth: NDArray[np.float64], estimate: NDArray[np.float64], unit: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Return distances of centres, divided by `unit` (width and height), shape (n,).

    The distance is NaN or infinite, and thus a miss, if the target is absent, the unit is 0 or the
    estimate is not finite. Boxes without size are valid.
    """
    difference = estimate[:, :2] + estimate[:, 2:] / 2 - (truth[:, :2] + truth[:, 2:] / 2)
    return np.asarray(np.sqrt(((difference / unit) ** 2).sum(axis=1)))


METRICS = Metrics(
    metrics={
        "success_auc": Metric("area under the success curve"),
        "precision_auc": Metric("area under the precision curve, up to 50 px"),
        "normalised_precision_auc": Metric(
            "area under the normalised precision curve, up to 0.5 sizes"
        ),
    },
    score=score_run,
    curves={
        "success": ("overlap threshold", "share of frames"),
        "precision": ("centre distance [px]", "share of frames"),
        "normalised_precision": ("centre distance [target sizes]", "share of frames"),
    },
    agrees_with="the TrackingNet devkit (metrics.py), apart from its factor of 100",
)
