"""Measures of the adaptive colour particle filter: size, occlusions, re-initialisation."""

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.measures import MeasuredRun, Values, measure

HIDDEN = 0.5  # visible share below which the target is hidden
GONE = 0.1  # visible share below which the target is hidden completely
CLEAR = 0.8  # visible share above which the target is in view again
RECOVERY = 30  # number of frames after the occlusion by the tree until the target is tracked
BRIDGE = 10  # frames after a short occlusion
END = 20  # number of last visible frames


class Hiding(NamedTuple):
    """Frames from `first` to before `stop` in which the target is hidden."""

    first: int
    stop: int
    is_complete: bool


def size_errors(measured: MeasuredRun) -> Values:
    """Return the relative error of Hx by frame, shape (n,)."""
    return np.asarray(np.abs(measured.boxes[:, 2] / measured.truth.boxes[:, 2] - 1))


@measure("share of Hx", lower_is_better=True)
def size_error(measured: MeasuredRun) -> float:
    """Return the mean relative error of Hx; the error is 1 in frames without an estimate."""
    return float(np.nan_to_num(size_errors(measured), nan=1.0)[measured.present].mean())


@measure("share")
def tracked_at_end(measured: MeasuredRun) -> float:
    """Return 1 if the target is tracked in more than half of the last 20 frames in view, else 0."""
    return float(on_target_at_end(measured) > 0.5)


@measure("share", kept_measure=tracked_at_end)
def on_target_at_end(measured: MeasuredRun) -> float:
    """Return the share of the last 20 frames in view in which the target is tracked."""
    clear = np.flatnonzero(measured.present & (measured.truth.visibility > CLEAR))
    return float(measured.on_target[clear[-END:]].mean())


@measure("share")
def initialises_behind_tree(measured: MeasuredRun) -> float:
    """Return 1 if the tracker re-initialises behind the tree and tracks afterwards, else 0.

    During the first complete occlusion, fewer than b N samples are positive and the tracker starts
    its initialisation. It tracks the target 30 frames after the target is visible again.
    """
    tree = next((hiding for hiding in hidings(measured) if hiding.is_complete), None)
    if tree is None or measured.record.failure:
        return 0.0
    gone = np.arange(tree.first, tree.stop)
    gone = gone[measured.truth.visibility[gone] < GONE]
    tracks = measured.detail("mode") > 0
    clear = np.flatnonzero(measured.truth.visibility > CLEAR)
    back = int(clear[clear >= tree.stop][0])
    initialises = bool((~tracks[gone]).any())
    return float(few_positive(measured)[gone].any() and initialises and tracks[back + RECOVERY])


@measure("share")
def bridges_short_occlusions(measured: MeasuredRun) -> float:
    """Return 1 if every short occlusion is bridged without initialisation, else 0.

    The target is tracked ten frames after an occlusion, and the tracker does not initialise before.
    Occlusions of a target that is already lost do not count. The result is NaN if none counts.
    """
    tracks = measured.detail("mode") > 0
    counted = [
        hiding
        for hiding in hidings(measured)
        if not hiding.is_complete
        and measured.on_target[hiding.first - 1]
        and tracks[hiding.first - 1]
    ]
    if not counted:
        return nan
    last = len(measured.on_target) - 1
    ends = [min(hiding.stop + BRIDGE, last) for hiding in counted]
    return float(
        all(
            measured.on_target[end] and tracks[hiding.first : end + 1].all()
            for hiding, end in zip(counted, ends, strict=True)
        )
    )


def few_positive(measured: MeasuredRun) -> NDArray[np.bool_]:
    """Return in which frames fewer than b N samples meet the appearance condition, shape (n,).

    N is the number of samples, and b is the parameter `kick_off`.
    """
    parameters = measured.record.identity.parameters
    threshold = float(parameters["kick_off"]) * float(parameters["particles"])
    return np.asarray(measured.detail("positive_appearances") < threshold)


def hidings(measured: MeasuredRun) -> list[Hiding]:
    """Return the occlusions of the target in order, without its exit from the view."""
    visible = np.where(measured.present, measured.truth.visibility, 0.0)
    frames = np.flatnonzero(measured.present)
    first, stop = int(frames[0]), int(frames[-1]) + 1
    hidden = np.flatnonzero(visible[first:stop] < HIDDEN) + first
    times = np.split(hidden, np.flatnonzero(np.diff(hidden) > 1) + 1)
    return [
        Hiding(int(time[0]), int(time[-1]) + 1, bool((visible[time] < GONE).any()))
        for time in times
        if len(time) and time[-1] + 1 < stop
    ]
