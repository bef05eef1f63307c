"""What happened in a run: sizes, updates, what became of the target when it was hidden."""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error, centre_inside
from bench.metrics.native import Truth

__all__ = ["COURSE", "Hiding", "course_of", "hidings"]

HIDDEN = 0.5
"""Visible fraction below which the target is hidden."""

GONE = 0.1
"""Visible fraction below which it is hidden completely."""

CLEAR = 0.8
"""Visible fraction above which it is in view again."""

PARTLY = 0.3, 0.9
"""Visible fractions between which it is partly hidden."""

RECOVERY, BRIDGE, END = 30, 10, 20  # frames
SETTLED = 5
"""Frames in a row with the centre inside that make a recovery: one alone is chance."""

FAST = 0.2
"""Share of the frames that are called fast."""

Flags = NDArray[np.bool_]

COURSE = (
    *("size_error", "size_bias", "size_correlation", "centre_rms"),
    *("good_frames", "good_updates", "other_frames", "other_updates", "waiting_frames"),
    "update_share",
    *("inside_partly_hidden", "inside_fast", "inside_otherwise"),
    *("recovered", "right_at_end", "count_fell", "initialised", "tracking_again"),
    *("bridged", "count_fell_shortly", "count_fell_at_end"),
)
"""Names of what `course_of` gives."""


@dataclass(frozen=True)
class Hiding:
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


def hidings(visibility: NDArray[np.float64], first: int, stop: int) -> list[Hiding]:
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
    found = []
    for run in np.split(hidden, np.flatnonzero(np.diff(hidden) > 1) + 1):
        if len(run) and run[-1] + 1 < stop:
            complete = bool((visibility[run] < GONE).any())
            found.append(Hiding(int(run[0]), int(run[-1]) + 1, complete))
    return found


def course_of(run: Run, truth: Truth) -> dict[str, float]:
    """What happened in a run.

    Parameters
    ----------
    run : Run
        Finished; of any tracker.
    truth : Truth
        Of its sequence.

    Returns
    -------
    dict of str to float
        NaN where what is asked did not arise, or the tracker does not say:

        - `size_error`, `size_bias`: mean of |Hx - truth| and of Hx - truth over the truth;
          `size_correlation` with the truth; `centre_rms`: root of the mean square [pixels];
        - `good_frames`, `good_updates`, `other_frames`, `other_updates`: see
          `bench.claims.checks.nummiaro2003`; `waiting_frames`: others in which the tracker
          initialises; `update_share`: of the frames in which it tracks;
        - `inside_partly_hidden`, `inside_fast`, `inside_otherwise`: shares of such frames with
          the centre inside; fast is the fifth in which the target moves most in the image;
        - `recovered`: tracking, five frames in a row inside, up to 30 frames after the first
          complete hiding; `right_at_end`: share inside of the last 20 frames in view;
        - `count_fell`, `initialised`: fewer than b N positive particles, or the mode, in a frame
          of that hiding; `tracking_again`: the mode 30 frames after it;
        - `bridged`: inside ten frames after each shorter hiding, and never initialising till
          then, of those before which it tracked and was inside; `count_fell_shortly`: fewer than
          b N in a frame of one of these;
        - `count_fell_at_end`: fewer than b N up to ten frames after the target left.
    """
    present: Flags = np.asarray(np.isfinite(truth.boxes).all(axis=1))
    first = int(np.flatnonzero(present)[0])
    after = np.arange(len(present)) > first
    inside = centre_inside(truth.regions.get("full", truth.boxes), run.boxes)
    found = dict.fromkeys(COURSE, nan)
    found |= _sizes(run.boxes, truth.boxes, present & after)
    found |= _where_inside(truth, inside, present & after)
    if "mode" in run.details:
        found |= _updates(run, truth, inside, after)
        found |= _occlusion(run, truth, inside, present)
    return found


def _sizes(
    boxes: NDArray[np.float64], truth: NDArray[np.float64], evaluated: Flags
) -> dict[str, float]:
    found, true = boxes[evaluated], truth[evaluated]
    error = found[:, 2] / true[:, 2] - 1
    changes = np.ptp(found[:, 2]) > 0 and np.ptp(true[:, 2]) > 0
    return {
        "size_error": float(np.abs(error).mean()),
        "size_bias": float(error.mean()),
        "size_correlation": float(np.corrcoef(found[:, 2], true[:, 2])[0, 1]) if changes else nan,
        "centre_rms": float(np.sqrt((centre_error(true, found) ** 2).mean())),
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


def _updates(run: Run, truth: Truth, inside: Flags, after: Flags) -> dict[str, float]:
    seen = ~(truth.visibility < HIDDEN) & np.isfinite(truth.boxes).all(axis=1)
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
    found = {
        "recovered": float(_settles(follows[back : back + RECOVERY + 1])),
        "right_at_end": _share(inside[clear[-END:]]),
        "count_fell": float(few[hidden].any()),
        "initialised": float((~tracks[hidden]).any()),
        "tracking_again": float(tracks[back + RECOVERY]),
    }
    short = [hiding for hiding in every if hiding.first > back and follows[hiding.first - 1]]
    if short:
        found["bridged"] = float(all(_is_bridged(hiding, inside, tracks) for hiding in short))
        fell = [few[hiding.first : hiding.stop].any() for hiding in short]
        found["count_fell_shortly"] = float(any(fell))
    if stop < len(present):
        found["count_fell_at_end"] = float(few[stop : stop + BRIDGE + 1].any())
    return found


def _is_bridged(hiding: Hiding, inside: Flags, tracks: Flags) -> bool:
    end = hiding.stop + BRIDGE
    return bool(inside[min(end, len(inside) - 1)] and tracks[hiding.first : end + 1].all())


def _settles(inside: Flags) -> bool:
    in_a_row = 0
    for flag in inside.tolist():
        in_a_row = in_a_row + 1 if flag else 0
        if in_a_row == SETTLED:
            return True
    return False


def _share(flags: Flags | NDArray[np.float64]) -> float:
    return float(flags.mean()) if len(flags) else nan
