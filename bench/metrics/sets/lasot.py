"""Success, precision and normalised precision as defined by the LaSOT toolkit.

The definitions are those of `otb` with these differences. Frames without target are misses. A box
with NaN or without size is replaced by the box of the previous frame; an infinite box is a miss. A
ground-truth box without size that is not flagged as absent, or with a coordinate left of or above
the first pixel, is a miss for success and a hit for precision. Normalised precision is the share of
frames with centres at most 0.20 apart, in widths and heights of the ground truth. Both centres
count pixels from 1. As in the toolkit, they are divided by the size before they are subtracted: the
order of operations changes rounding at thresholds. All sequences have equal weights, including
those with misses only. Fan et al., "LaSOT: a high-quality benchmark for large-scale single object
tracking", CVPR 2019.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import is_well_formed, overlap
from trackmark.bench.metrics.curves import DISTANCES, NORMALISED_DISTANCES, OVERLAPS, share_curve
from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    RunEstimates,
    select_evaluated,
)

_INDEX_OF_20 = 20  # threshold of 20 px, and of 0.20 target sizes


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return scores and curves of a run."""
    run = select_evaluated(truth, estimates)
    t, present = run.truth, run.present
    e = _replace_malformed(run.estimate, present | run.malformed)
    # The toolkit counts pixels from 1. It treats ground truth with a smaller coordinate as invalid.
    valid = present & (t[:, :2] > -1).all(axis=1) & (t[:, 2:] > 0).all(axis=1)
    always_hit = present & ~valid | run.malformed
    overlaps = np.where(valid, overlap(t, e), -1.0)
    errors = np.where(always_hit, -1.0, _centre_errors(t, e, np.ones_like(t[:, 2:])))
    normalised = np.where(always_hit, -1.0, _centre_errors(t, e, t[:, 2:]))
    success = share_curve(overlaps, OVERLAPS, above=True)
    precision = share_curve(errors, DISTANCES)
    by_size = share_curve(normalised, NORMALISED_DISTANCES)
    scores = {
        "success_auc": float(success[:, 1].mean()),
        "precision": float(precision[_INDEX_OF_20, 1]),
        "normalised_precision": float(by_size[_INDEX_OF_20, 1]),
    }
    curves = {"success": success, "precision": precision, "normalised_precision": by_size}
    return MetricResult(scores, curves)


def _centre_errors(
    truth: NDArray[np.float64], estimate: NDArray[np.float64], unit: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Compute distances of centres in the toolkit's order of operations, shape (n,).

    `unit`: width and height by which both centres are divided, shape (n, 2). The distance is NaN if
    the target is absent and infinite if the estimate is malformed.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t, e = (
            (boxes[:, :2] + 1.0 + (boxes[:, 2:] - 1.0) / 2) / unit for boxes in (truth, estimate)
        )
        distance = np.sqrt(((e - t) ** 2).sum(axis=1))
    absent = np.isnan(truth).any(axis=1)
    return np.where(is_well_formed(estimate) | absent, distance, np.inf)


def _replace_malformed(
    estimate: NDArray[np.float64], present: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Replace estimates with NaN or without size by the estimate of the previous frame.

    Infinite estimates are kept, and thus misses. As in the toolkit, estimates in frames without
    target are kept and can replace the next estimate.
    """
    boxes = estimate.copy()
    is_replaced = np.isnan(estimate).any(axis=1) | (estimate[:, 2:] <= 0).any(axis=1)
    for i in np.flatnonzero(present & is_replaced):
        boxes[i] = boxes[i - 1]
    return boxes


METRICS = Metrics(
    metrics={
        "success_auc": Metric("mean of the success curve over 21 thresholds", 20 / 21),
        "precision": Metric("share of frames with centres at most 20 px apart"),
        "normalised_precision": Metric("share of frames with centres at most 0.20 sizes apart"),
    },
    score=score_run,
    curves={
        "success": ("overlap threshold", "share of frames"),
        "precision": ("centre distance [px]", "share of frames"),
        "normalised_precision": ("centre distance [target sizes]", "share of frames"),
    },
    agrees_with="the LaSOT evaluation toolkit (MATLAB)",
)
