"""Measures on masks: region similarity J, and losses at jumps of the light."""

from math import nan

import numpy as np

from trackmark.bench.papers.measures import MeasuredRun, Values, kept_to_end, measure

TRACKED = 0.5  # minimum J of a tracked frame
JUMP = "light change"
"""Attribute of frames in which the light jumps."""

AFTER = 10  # frames after a jump


def similarity(measured: MeasuredRun) -> Values:
    """Return J by frame, shape (n,); NaN in the init frame and if the target is invisible."""
    segmentation = measured.record.segmentation
    if measured.record.failure or segmentation is None:
        return np.where(measured.present, 0.0, nan)
    return np.asarray(segmentation.region_similarity, np.float64)


def tracked(measured: MeasuredRun) -> Values:
    """Return 1 in frames in which J is 0.5 or more, or undefined, else 0, shape (n,)."""
    values = similarity(measured)
    return np.asarray(np.isnan(values) | (values >= TRACKED), np.float64)


@measure("J")
def mean_similarity(measured: MeasuredRun) -> float:
    """Return the mean of J over the frames in which J is defined."""
    return float(np.nanmean(similarity(measured)))


@measure("share")
def not_kept(measured: MeasuredRun) -> float:
    """Return 1 if the target is not kept, else 0."""
    return 1.0 - kept_to_end(measured)


@measure("share")
def lost_after_jump(measured: MeasuredRun) -> float:
    """Return 1 if J is below 0.5 in the tenth frame after the first jump of the light, else 0."""
    jump = int(np.flatnonzero(measured.truth.attributes[JUMP])[0])
    return float(not measured.on_target[jump + AFTER - 1])
