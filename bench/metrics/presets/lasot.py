"""Success, precision and normalised precision as the LaSOT toolkit has them.

As in `otb`, but: frames without target are misses; a malformed box is replaced by the one of the
frame before; and a truth box that begins left of or above the first pixel, or has no size, is a
miss for success and a hit for precision, as this toolkit scores it. Normalised precision is the
share of frames whose centres are at most 0.20 apart, in widths and heights of the ground truth.
Both centres count pixels from 1 and are divided by that size before they are subtracted, in the
toolkit's order: rounding decides about frames at a threshold. Each sequence counts once, also one
that is missed altogether. Fan et al., "LaSOT: a high-quality
benchmark for large-scale single object tracking", CVPR 2019.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.curves import DISTANCES, NORMALISED_DISTANCES, OVERLAPS, shares
from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.overlap import is_well_formed, overlap
from trackmark.bench.metrics.preset import Answer, Axes, Column, Judged, Preset, started

_AT_20 = 20  # pixels, and hundredths of the target's size


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return scores and curves of a run."""
    run = started(truth, answer)
    t, present = run.truth, run.present
    e = _repeated(run.estimate, present)
    # The toolkit counts pixels from 1, and takes truth with a number below that for invalid.
    valid = present & (t[:, :2] > -1).all(axis=1) & (t[:, 2:] > 0).all(axis=1)
    hit = present & ~valid
    overlaps = np.where(valid, overlap(t, e), -1.0)
    errors = np.where(hit, -1.0, _centre_errors(t, e, np.ones_like(t[:, 2:])))
    normalised = np.where(hit, -1.0, _centre_errors(t, e, t[:, 2:]))
    success = shares(overlaps, OVERLAPS, above=True)
    precision = shares(errors, DISTANCES)
    by_size = shares(normalised, NORMALISED_DISTANCES)
    scores = {
        "success_auc": float(success[:, 1].mean()),
        "precision": float(precision[_AT_20, 1]),
        "normalised_precision": float(by_size[_AT_20, 1]),
    }
    curves = {"success": success, "precision": precision, "normalised_precision": by_size}
    return Judged(scores, curves)


def _centre_errors(
    truth: NDArray[np.float64], estimate: NDArray[np.float64], unit: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Compute distances of centres in the toolkit's order of operations, shape (n,).

    `unit`: width and height by which both centres are divided, shape (n, 2). NaN where the target
    is absent, infinite where the estimate is malformed.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t, e = (
            (boxes[:, :2] + 1.0 + (boxes[:, 2:] - 1.0) / 2) / unit for boxes in (truth, estimate)
        )
        distance = np.sqrt(((e - t) ** 2).sum(axis=1))
    absent = np.isnan(truth).any(axis=1)
    return np.where(is_well_formed(estimate) | absent, distance, np.inf)


def _repeated(estimate: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Estimates with the one of the frame before in the place of malformed ones.

    Not where the target is absent: such frames count for nothing, but what stands there is
    repeated in the next.
    """
    boxes = estimate.copy()
    for i in np.flatnonzero(present & ~is_well_formed(estimate)):
        boxes[i] = boxes[i - 1]
    return boxes


PRESET = Preset(
    columns={
        "success_auc": Column("mean of the success curve over 21 thresholds", 20 / 21),
        "precision": Column("share of frames with centres at most 20 px apart"),
        "normalised_precision": Column("share of frames with centres at most 0.20 sizes apart"),
    },
    judge=judge,
    curves={
        "success": Axes("overlap threshold", "share of frames"),
        "precision": Axes("centre distance [px]", "share of frames"),
        "normalised_precision": Axes("centre distance [target sizes]", "share of frames"),
    },
    agrees="the LaSOT evaluation toolkit (MATLAB)",
)
