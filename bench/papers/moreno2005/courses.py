"""What happened in a run by its masks: where the target was lost, and what surrounded it."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.record import Run
from bench.store.truth import StoredTruth
from datasets import Sequence

__all__ = ["JUMP", "PATCH", "TRACKED", "course_of", "patch_means"]

TRACKED = 0.5
"""Region similarity below which a frame is not tracked."""

GONE = 0.1  # below which next to nothing of the target is in the mask

JUMP, PATCH = "light change", "similar patch"
"""Attributes: frames in which the light jumps, or a patch of the target's colour touches it."""

AFTER = 10
"""Frames, the first of a jump included, within which a target counts as lost by it."""

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
        below .5 in the tenth frame from the first jump of the light on), `near_patch` and
        `elsewhere` (means over frames with and without a patch of the target's colour at it).
    """
    similarity = _similarity(run)
    below = np.flatnonzero(similarity < TRACKED)
    near, elsewhere = patch_means(similarity, truth)
    return {
        "first_loss": float(below[0] if len(below) else len(similarity)),
        "tracked": float(not len(below)),
        "gone": float((similarity < GONE).any()),
        "least_similarity": float(np.nanmin(similarity)),
        "lost_by_jump": _lost_by_jump(similarity, truth),
        "near_patch": near,
        "elsewhere": elsewhere,
    }


def patch_means(similarity: Values, truth: Truth) -> tuple[float, float]:
    """Means over frames with a similar patch at the target, and without; NaN for no such frames."""
    touched = truth.attributes.get(PATCH, np.zeros(len(similarity), bool))
    means = [
        float(similarity[chosen & np.isfinite(similarity)].mean())
        if (chosen & np.isfinite(similarity)).any()
        else nan
        for chosen in (touched, ~touched)
    ]
    return means[0], means[1]


def _similarity(run: Run) -> Values:
    assert run.segmentation is not None
    similarity: Values = run.segmentation.region_similarity
    return similarity


def _lost_by_jump(similarity: Values, truth: Truth) -> float:
    jumps = np.flatnonzero(truth.attributes.get(JUMP, np.zeros(len(similarity), bool)))
    judged = jumps[:1] + AFTER - 1
    if not len(judged) or judged[0] >= len(similarity):
        return nan
    return float(similarity[judged[0]] < TRACKED)
