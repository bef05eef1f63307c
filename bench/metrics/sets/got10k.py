"""Average overlap and success rates as defined by the GOT-10k toolkit.

The first frame is ignored, as are frames in which the target is not visible. Unknown visibility
counts as visible. Boxes are clipped to the image as in the toolkit: a box that begins left of or
above the image is moved inside without changing its size. AO is the mean overlap over all frames of
all sequences and repetitions, so that long sequences have larger weights. SR50 and SR75 are the
shares of these frames with an overlap above 0.5 and 0.75. A malformed box is a miss, and so is any
box in a frame whose ground truth has no size and no label of absence. Huang, Zhao, Huang, "GOT-10k:
a large high-diversity benchmark for generic object tracking in the wild", TPAMI 2021.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import is_well_formed, overlap
from trackmark.bench.metrics.curves import share_curve
from trackmark.bench.metrics.interface import (
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    ResultsBySequence,
    RunEstimates,
    select_evaluated,
)

_THRESHOLDS = np.linspace(0, 1, 101)


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return scores and curve of a run."""
    run = select_evaluated(truth, estimates)
    t, e = run.truth, run.estimate
    visibility = np.broadcast_to(truth.visibility, len(truth.boxes))[run.frames]
    counted = (run.present | run.malformed) & ~(visibility <= 0)
    counted[0] = False
    t, e = t[counted], e[counted]
    if run.size is not None:
        well_formed = is_well_formed(e)
        t, e = _clip(t, run.size), np.where(well_formed[:, None], _clip(e, run.size), 0.0)
    return _score(np.nan_to_num(overlap(t, e)))  # 0 for ground truth without size


def combine(runs: ResultsBySequence) -> MetricResult:
    """Return the scores over all frames of all runs."""
    return _score(np.concatenate([run.intermediate["overlaps"] for group in runs for run in group]))


def _score(overlaps: NDArray[np.float64]) -> MetricResult:
    success = share_curve(overlaps, _THRESHOLDS, above=True)
    has_frames = len(overlaps) > 0
    scores = {
        "ao": float(overlaps.mean()) if has_frames else np.nan,
        "sr50": float(success[50, 1]),
        "sr75": float(success[75, 1]),
    }
    return MetricResult(scores, {"success": success}, {"overlaps": overlaps})


def _clip(boxes: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    corner = np.clip(boxes[:, :2], 0, size)
    return np.column_stack([corner, np.clip(boxes[:, 2:], 0, size - corner)])


METRICS = Metrics(
    metrics={
        "ao": Metric("average overlap"),
        "sr50": Metric("share of frames with an overlap above 0.5"),
        "sr75": Metric("share of frames with an overlap above 0.75"),
    },
    score=score_run,
    combine=combine,
    curves={"success": ("overlap threshold", "share of frames")},
    agrees_with="got10k's ExperimentGOT10k",
    undefined="no frame after the first shows the target (absent, or labels of 0 in cover.label)",
)
