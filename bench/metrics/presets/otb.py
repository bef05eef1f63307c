"""Success and precision as the OTB benchmark has them, which a perfect tracker scores .952 by.

The success curve is the share of frames with an overlap above each of 21 thresholds (0, 0.05, …,
1), the score its mean: no overlap is above 1, so the best is 20/21. Precision is the share of
frames with centres at most 20 pixels apart, where distances are rounded to 4 decimals first (as
jwlim/tracker_benchmark does: 20.00004 is a hit). All frames from that of initialisation on count,
which is overwritten by the truth; absent frames and malformed boxes are misses everywhere. Each
sequence counts once. Wu, Lim, Yang, "Object Tracking Benchmark", TPAMI 2015.
"""

import numpy as np

from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.curves import DISTANCES, OVERLAPS, shares
from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.metrics.preset import Answer, Axes, Column, Judged, Preset, started

_AT_20_PIXELS = 20
_AT_HALF = 10
# The largest numbers that round to at most a threshold, to 4 decimals. Python rounds like the
# toolkit; NumPy multiplies first, and differs at ties.
_TIES = [(k, k + 0.5e-4) for k in DISTANCES.tolist()]
_LIMITS = np.array([x if round(x, 4) <= k else np.nextafter(x, 0) for k, x in _TIES])


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return scores and curves of a run."""
    run = started(truth, answer)
    t, e, n = run.truth, run.estimate, len(run.truth)
    overlaps = np.where(run.present, overlap(t, e), 0.0)
    success = shares(overlaps, OVERLAPS, above=True)
    precision = shares(centre_error(t, e), _LIMITS)
    precision[:, 0] = DISTANCES
    scores = {
        "success_auc": float(success[:, 1].mean()),
        "precision": float(precision[_AT_20_PIXELS, 1]),
        "success_rate": float(success[_AT_HALF, 1]),
        "mean_overlap": float(overlaps.mean()),
        "success_published": float(np.count_nonzero(overlaps >= OVERLAPS[_AT_HALF]) / n),
    }
    return Judged(scores, {"success": success, "precision": precision})


PRESET = Preset(
    columns={
        "success_auc": Column("mean of the success curve over 21 thresholds", 20 / 21),
        "precision": Column("share of frames with centres at most 20 px apart"),
        "success_rate": Column("share of frames with an overlap above 0.5"),
        "mean_overlap": Column("mean overlap over all frames, as published beside the curves"),
        "success_published": Column("share of frames with an overlap of 0.5 or more, likewise"),
    },
    judge=judge,
    curves={
        "success": Axes("overlap threshold", "share of frames"),
        "precision": Axes("centre distance [px]", "share of frames"),
    },
    agrees="the OTB toolkits (MATLAB, jwlim/tracker_benchmark) and got10k's ExperimentOTB",
    also=("otb100-auc",),
)
