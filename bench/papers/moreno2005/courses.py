"""What happened in a run by its masks: where the target was lost, and what surrounded it."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.store.truth import StoredTruth
from datasets import Sequence

__all__ = ["COURSE", "JUMP", "PATCH", "TRACKED", "course_of"]

TRACKED = 0.5
"""Region similarity below which a frame is not tracked."""

GONE = 0.1  # below which next to nothing of the target is in the mask

JUMP, PATCH = "light change", "similar patch"
"""Attributes: frames in which the light jumps, or a patch of the target's colour touches it."""

COURSE = (
    "first_loss",
    "tracked",
    "gone",
    "least_similarity",
    "lost_by_jump",
    "near_patch",
    "elsewhere",
)
"""What is known of a run."""

AFTER = 10
"""Which frame from a jump on, itself the first, tells whether a target was lost by it."""

Truth = StoredTruth | Sequence
Values = NDArray[np.float64]


def course_of(run: Run, truth: Truth) -> dict[str, float]:
    """What is known of a finished run whose tracker gave masks.

    Parameters
    ----------
    run : Run
        With `segmentation`.
    truth : StoredTruth or Sequence
        Of its sequence.

    Returns
    -------
    dict of str to float
        A yes or no is 1 or 0, NaN where what is asked did not arise. `first_loss` (first frame with
        region similarity below .5; the number of frames for none), `tracked` (there is none),
        `gone` (whether it was ever below .1), `least_similarity`, `lost_by_jump` (whether it is
        below .5 in the tenth frame from the first jump of the light on, of those that had it in the
        frame before the jump), `near_patch` and
        `elsewhere` (means over frames with and without a patch of the target's colour at it).
    """
    assert run.segmentation is not None
    similarity: Values = run.segmentation.region_similarity
    below = np.flatnonzero(similarity < TRACKED)
    near, elsewhere = _patch_means(similarity, truth)
    found = (
        float(below[0] if len(below) else len(similarity)),
        float(not len(below)),
        float((similarity < GONE).any()),
        float(np.nanmin(similarity)),
        _lost_by_jump(similarity, truth),
        near,
        elsewhere,
    )
    return dict(zip(COURSE, found, strict=True))


def _patch_means(similarity: Values, truth: Truth) -> tuple[float, float]:
    """Means over frames with a similar patch at the target, and without; NaN for none with one."""
    touched = truth.attributes.get(PATCH, np.zeros(len(similarity), bool))
    known = np.isfinite(similarity)
    near, elsewhere = similarity[touched & known], similarity[~touched & known]
    return float(near.mean()) if len(near) else nan, float(elsewhere.mean())


def _lost_by_jump(similarity: Values, truth: Truth) -> float:
    jumps = np.flatnonzero(truth.attributes.get(JUMP, np.zeros(len(similarity), bool)))
    judged = jumps[:1] + AFTER - 1
    if not len(judged) or judged[0] >= len(similarity):
        return nan
    before, after = similarity[jumps[0] - 1], similarity[judged[0]]
    # The first frame, which is given, has no similarity: there the target was not lost.
    if before < TRACKED or np.isnan(after):
        return nan
    return float(after < TRACKED)
