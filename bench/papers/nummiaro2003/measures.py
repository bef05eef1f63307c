"""Measures of runs of the adaptive colour particle filter: sizes, occlusions, initialisation."""

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.measures import Course, Values, measure

HIDDEN = 0.5  # visible share below which the target is hidden
GONE = 0.1  # visible share below which it is hidden completely
CLEAR = 0.8  # visible share above which it is in view again
RECOVERY = 30  # frames after the tree within which the tracker tracks again
BRIDGE = 10  # frames after a short occlusion, and after the target has left the view
END = 20  # visible frames at the end


class Hiding(NamedTuple):
    """A time in which the target is hidden: from `first` to before `stop`."""

    first: int
    stop: int
    complete: bool


def _size_error(course: Course) -> Values:
    return np.asarray(np.abs(course.boxes[:, 2] / course.truth.boxes[:, 2] - 1))


SERIES = {
    "half_width": lambda course: course.boxes[:, 2] / 2,
    "true_half_width": lambda course: course.truth.boxes[:, 2] / 2,
    "size_error": _size_error,
}
"""Hx of the estimate and of the truth in pixels, and |Hx - truth| / truth."""


@measure("of Hx", lower_is_better=True)
def size_error(course: Course) -> float:
    """Return the mean of |Hx - truth| / truth; 1 in frames without an estimate."""
    return float(np.nan_to_num(_size_error(course), nan=1.0)[course.present].mean())


@measure("share")
def on_target_at_end(course: Course) -> float:
    """Return the share of the last 20 frames in view in which the target is tracked."""
    clear = np.flatnonzero(course.present & (course.truth.visibility > CLEAR))
    return float(course.on_target[clear[-END:]].mean())


@measure("share")
def initialises_behind_tree(course: Course) -> float:
    """Return 1 if behind the tree the count falls and initialisation starts, and tracking follows.

    In a frame of the first complete occlusion fewer than b N samples are positive, in one the
    tracker initialises, and 30 frames after the target is back it tracks.
    """
    tree = next((one for one in hidings(course) if one.complete), None)
    if tree is None or course.run.failure:
        return 0.0
    gone = np.arange(tree.first, tree.stop)
    gone = gone[course.truth.visibility[gone] < GONE]
    tracks = course.detail("mode") > 0
    clear = np.flatnonzero(course.truth.visibility > CLEAR)
    back = int(clear[clear >= tree.stop][0])
    initialises = bool((~tracks[gone]).any())
    return float(few_positive(course)[gone].any() and initialises and tracks[back + RECOVERY])


@measure("share")
def bridges_short_occlusions(course: Course) -> float:
    """Return 1 if every short occlusion is bridged without initialisation.

    Ten frames after each the target is tracked, and the mode is tracking until then. Occlusions
    before which the target is not tracked do not count; NaN if there is no other.
    """
    tracks = course.detail("mode") > 0
    counted = [
        one
        for one in hidings(course)
        if not one.complete and course.on_target[one.first - 1] and tracks[one.first - 1]
    ]
    if not counted:
        return nan
    last = len(course.on_target) - 1
    ends = [min(one.stop + BRIDGE, last) for one in counted]
    return float(
        all(
            course.on_target[end] and tracks[one.first : end + 1].all()
            for one, end in zip(counted, ends, strict=True)
        )
    )


@measure("share")
def count_falls_at_exit(course: Course) -> float:
    """Return 1 if fewer than b N samples are positive within ten frames of the target's leaving."""
    left = int(np.flatnonzero(course.present)[-1]) + 1
    return float(few_positive(course)[left : left + BRIDGE + 1].any())


def few_positive(course: Course) -> NDArray[np.bool_]:
    """Return frames in which fewer than b N samples fulfil the appearance condition, shape (n,)."""
    parameters = course.run.identity.parameters
    threshold = float(parameters["kick_off"]) * float(parameters["particles"])
    return np.asarray(course.detail("positive_appearances") < threshold)


def hidings(course: Course) -> list[Hiding]:
    """Return the times in which the target is hidden, in order; its leaving is none."""
    visible = np.where(course.present, course.truth.visibility, 0.0)
    frames = np.flatnonzero(course.present)
    first, stop = int(frames[0]), int(frames[-1]) + 1
    hidden = np.flatnonzero(visible[first:stop] < HIDDEN) + first
    times = np.split(hidden, np.flatnonzero(np.diff(hidden) > 1) + 1)
    return [
        Hiding(int(time[0]), int(time[-1]) + 1, bool((visible[time] < GONE).any()))
        for time in times
        if len(time) and time[-1] + 1 < stop
    ]
