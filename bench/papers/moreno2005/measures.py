"""Measures of runs on masks: region similarity J, and what becomes of it at a patch or a jump."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.measures import KEPT_SHARE, Course, Values, kept, measure

TRACKED = 0.5  # region similarity from which on a frame is tracked
JUMP, PATCH = "light change", "similar patch"
"""Attributes: frames in which the light jumps, or a patch of the target's colour touches it."""

AFTER = 10  # frames after a jump


def similarity(course: Course) -> Values:
    """Return J by frame, shape (n,); NaN where the target is not seen and in the given frame."""
    segmentation = course.run.segmentation
    if course.run.failure or segmentation is None:
        return np.where(course.present, 0.0, nan)
    return np.asarray(segmentation.region_similarity, np.float64)


def _tracked(course: Course) -> Values:
    values = similarity(course)
    return np.asarray(np.isnan(values) | (values >= TRACKED), np.float64)


SERIES = {"similarity": similarity, "tracked": _tracked}
"""J; and 1 where it is 0.5 or more, or is not known."""


@measure("J")
def mean_similarity(course: Course) -> float:
    """Return the mean of J over the frames in which it is known."""
    return float(np.nanmean(similarity(course)))


@measure("share")
def not_kept(course: Course) -> float:
    """Return 1 if the target is not kept."""
    return 1.0 - kept(course)


@measure("share")
def tracked_at_patch(course: Course) -> float:
    """Return 1 if J is 0.5 or more in 90 % of the frames in which a similar patch touches it."""
    return float(course.on_target[_frames(course, PATCH)].mean() >= KEPT_SHARE)


@measure("share")
def lost_after_jump(course: Course) -> float:
    """Return 1 if J is below 0.5 in the tenth frame from the first jump of the light on."""
    jump = int(np.flatnonzero(_frames(course, JUMP))[0])
    return float(not course.on_target[jump + AFTER - 1])


def _frames(course: Course, attribute: str) -> NDArray[np.bool_]:
    return np.asarray(course.truth.attributes[attribute], bool)
