"""What happened in a run: sizes, updates, what became of the target when it was hidden."""

from math import nan
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error, centre_inside
from bench.metrics.native import Truth, first_loss
from bench.papers.measures import Course

__all__ = ["GONE", "HIDDEN", "NAMES", "Hiding", "hidings", "of_run"]

HIDDEN = 0.5  # visible fraction below which the target is hidden
GONE = 0.1  # likewise, completely
CLEAR = 0.8  # visible fraction above which it is in view again
PARTLY = 0.3, 0.9  # visible fractions between which it is partly hidden

RECOVERY, BRIDGE, END = 30, 10, 20  # frames
SETTLED = 5  # frames in a row with the centre inside that make a recovery: one alone is chance
FAST = 0.2  # share of the frames that are called fast

Flags: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]

NAMES = (
    *("frames", "first_loss", "size_error", "size_bias", "size_correlation", "centre_rms"),
    *("inside_partly_hidden", "inside_fast", "inside_otherwise"),
    *("good_frames", "good_updates", "other_frames", "other_updates", "waiting_frames"),
    *("update_share", "recovered", "right_at_end", "count_fell", "initialised"),
    *("tracking_again", "bridged", "count_fell_shortly", "count_fell_at_end"),
)


class Hiding(NamedTuple):
    """A time for which the target is hidden.

    Attributes
    ----------
    first, stop : int
        Frames; `stop` is the first in which it is no longer hidden.
    complete : bool
        Whether it is hidden completely in between.
    """

    first: int
    stop: int
    complete: bool


def of_run(course: Course) -> dict[str, float]:
    """What happened in a run, of any tracker.

    Returns
    -------
    dict of str to float
        NaN where what is asked did not arise, or the tracker does not say:

        - `frames`, `first_loss`: the length, and what of it is before the loss, of the frames
          alone in which the target is there;
        - `size_error`, `size_bias`: mean of |Hx - truth| and of Hx - truth over the truth;
          `size_correlation` with the truth; `centre_rms`: root of the mean square [pixels];
        - `inside_partly_hidden`, `inside_fast`, `inside_otherwise`: shares of such frames with
          the centre inside; fast is the fifth in which the target moves most in the image;
        - `good_frames`, `other_frames`: those in which it tracks, half of the target or more is
          visible and the centre inside, and the others; `good_updates`, `other_updates`: those of
          either in which the model was updated; `waiting_frames`: others in which the tracker
          initialises; `update_share`: of the frames in which it tracks;
        - `recovered`: tracking, five frames in a row inside, up to 30 frames after the first
          complete hiding; `right_at_end`: share inside of the last 20 frames in view;
        - `count_fell`, `initialised`: fewer than b N positive particles, or the mode, in a frame
          of that hiding; `tracking_again`: the mode 30 frames after it;
        - `bridged`: inside ten frames after each shorter hiding, and never initialising till
          then, of those before which it tracked and was inside; `count_fell_shortly`: fewer than
          b N in a frame of one of these;
        - `count_fell_at_end`: fewer than b N up to ten frames after the target left.
    """
    run, truth = course.run, course.truth
    present: Flags = np.asarray(np.isfinite(truth.boxes).all(axis=1))
    evaluated = present & (np.arange(len(present)) > np.flatnonzero(present)[0])
    inside = centre_inside(truth.regions.get("full", truth.boxes), run.boxes)
    lost = first_loss(inside, evaluated, truth.visibility)
    said = dict.fromkeys(NAMES, nan)
    said |= {"frames": float(present.sum()), "first_loss": float(present[:lost].sum())}
    said |= _sizes(run.boxes, truth.boxes, evaluated) | _where_inside(truth, inside, evaluated)
    if "mode" in run.details:
        said |= _updates(run, truth, inside, present) | _occlusion(run, truth, inside, present)
    return said


def hidings(visibility: Array, first: int, stop: int) -> list[Hiding]:
    """Times for which the target is hidden between two frames, in order.

    Parameters
    ----------
    visibility : ndarray of float64, shape (n,)
        Visible fraction; NaN counts as visible.
    first, stop : int
        Frames of the target's appearance and after its last; what reaches until then is its
        leaving, and no hiding.
    """
    hidden = np.flatnonzero(visibility[first:stop] < HIDDEN) + first
    times = np.split(hidden, np.flatnonzero(np.diff(hidden) > 1) + 1)
    return [
        Hiding(int(time[0]), int(time[-1]) + 1, bool((visibility[time] < GONE).any()))
        for time in times
        if len(time) and time[-1] + 1 < stop
    ]


def _sizes(boxes: Array, truth: Array, evaluated: Flags) -> dict[str, float]:
    widths, true = boxes[evaluated, 2], truth[evaluated, 2]
    error = widths / true - 1
    changes = np.ptp(widths) > 0 and np.ptp(true) > 0
    distances = centre_error(truth[evaluated], boxes[evaluated])
    return {
        "size_error": float(np.abs(error).mean()),
        "size_bias": float(error.mean()),
        "size_correlation": float(np.corrcoef(widths, true)[0, 1]) if changes else nan,
        "centre_rms": float(np.sqrt((distances**2).mean())),
    }


def _where_inside(truth: Truth, inside: Flags, evaluated: Flags) -> dict[str, float]:
    visible = truth.visibility
    partly = evaluated & (visible >= PARTLY[0]) & (visible <= PARTLY[1])
    centres = truth.boxes[:, :2] + truth.boxes[:, 2:] / 2
    steps = np.r_[nan, np.hypot(*np.diff(centres, axis=0).T)]
    known = evaluated & np.isfinite(steps)
    fast = known & (steps >= np.quantile(steps[known], 1 - FAST))
    return {
        "inside_partly_hidden": _share(inside[partly]),
        "inside_fast": _share(inside[fast]),
        "inside_otherwise": _share(inside[known & ~fast]),
    }


def _updates(run: Run, truth: Truth, inside: Flags, present: Flags) -> dict[str, float]:
    after = np.arange(len(present)) > np.flatnonzero(present)[0]
    seen = ~(truth.visibility < HIDDEN) & present
    tracks = run.details["mode"] > 0  # there is no update while it initialises
    good = after & seen & inside & tracks
    every_other = after & ~(seen & inside)
    other = every_other & tracks
    updated = run.details["updated"]
    return {
        "good_frames": float(good.sum()),
        "good_updates": float(np.nansum(updated[good])),
        "other_frames": float(other.sum()),
        "other_updates": float(np.nansum(updated[other])),
        "waiting_frames": float((every_other & ~tracks).sum()),
        "update_share": _share(updated[after & tracks]),
    }


def _occlusion(run: Run, truth: Truth, inside: Flags, present: Flags) -> dict[str, float]:
    visible = np.where(present, truth.visibility, 0.0)
    first, stop = int(np.flatnonzero(present)[0]), int(np.flatnonzero(present)[-1]) + 1
    every = hidings(visible, first, stop)
    complete = next((hiding for hiding in every if hiding.complete), None)
    if complete is None:
        return {}
    parameters = run.identity.parameters
    few = run.details["positive_appearances"] < parameters["kick_off"] * parameters["particles"]
    tracks = run.details["mode"] > 0
    follows = inside & tracks
    hidden = np.arange(complete.first, complete.stop)
    hidden = hidden[visible[hidden] < GONE]
    clear = np.flatnonzero(visible > CLEAR)
    back = int(clear[clear >= complete.stop][0])
    in_a_row = np.convolve(follows[back : back + RECOVERY + 1], np.ones(SETTLED))
    said = {
        "recovered": float(in_a_row.max() == SETTLED),
        "right_at_end": _share(inside[clear[-END:]]),
        "count_fell": float(few[hidden].any()),
        "initialised": float((~tracks[hidden]).any()),
        "tracking_again": float(tracks[back + RECOVERY]),
    }
    short = [hiding for hiding in every if hiding.first > back and follows[hiding.first - 1]]
    if short:
        said["bridged"] = float(all(_is_bridged(hiding, inside, tracks) for hiding in short))
        fell = [few[hiding.first : hiding.stop].any() for hiding in short]
        said["count_fell_shortly"] = float(any(fell))
    if stop < len(present):
        said["count_fell_at_end"] = float(few[stop : stop + BRIDGE + 1].any())
    return said


def _is_bridged(hiding: Hiding, inside: Flags, tracks: Flags) -> bool:
    end = hiding.stop + BRIDGE
    return bool(inside[min(end, len(inside) - 1)] and tracks[hiding.first : end + 1].all())


def _share(flags: Flags | Array) -> float:
    return float(flags.mean()) if len(flags) else nan
