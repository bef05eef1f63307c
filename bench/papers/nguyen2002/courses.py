"""What happened in a run by one of its traces: success, occlusions detected, where it was lost."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run, Trace
from bench.metrics.centre_error import centres
from bench.metrics.native import SUCCESS_OVERLAP
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in
from bench.store.truth import StoredTruth
from datasets import Sequence

__all__ = ["SWITCH", "course_of"]

SUCCESS, LAST = 0.9, 5
"""A run succeeds with enough overlap in this share of clear frames, and in all of the last."""

IN_VIEW = 0.75
"""Visible part from which on a target can be found again."""

SWITCH = "lamp off"
"""Attribute of frames in which one of the lamps is off."""

MOMENT = 3
"""Frames before and after a change within which something happens at its moment."""

KEPT = 20
"""Frames from the change on in which the box must stay."""

Truth = StoredTruth | Sequence


def course_of(run: Run, truth: Truth, trace: Trace, first_loss: float) -> dict[str, float]:
    """What is known of a finished run.

    Parameters
    ----------
    run : Run
        Of `nguyen2002`.
    truth : StoredTruth or Sequence
        Of its sequence.
    trace : {'online', 'revised'}
        Which of its boxes are meant.
    first_loss : float
        First frame in which they are off the target for long; the number of frames for none. See
        `bench.metrics.native`.

    Returns
    -------
    dict of str to float
        A yes or no is 1 or 0, NaN where what is asked did not arise. `on_target` (share of the
        clear frames with enough overlap), `success`, `said_hidden` (share of the clear frames
        in which the tracker said at once that the target is hidden, whatever the trace), `jitter`
        (mean length of the second difference of the centre less the true one, over clear frames
        [pixels]), `outliers` (mean share in frames that the tracker trusts);
        `occlusions`, `declared`, `detected` (numbers), `detected_share` (of the occlusions),
        `false_occlusions` (number). Where a lamp is off for a while: `lost_at_switch`,
        `lost_at_off` (at the moment of a change, or of the first),
        `kept_after_off` (share of the clear ones among the frames from the change on with enough
        overlap), `clear_after_off` (their number).
    """
    boxes = run.boxes_in(trace)
    good = overlap(truth.boxes, boxes) >= SUCCESS_OVERLAP
    clear = truth.visibility >= CLEAR
    clear[0] = False  # the box is given
    events = declared_in(run)
    trusted = run.details["occluded"] == 0
    known = {
        "on_target": float(good[clear].mean()),
        "success": float(good[clear].mean() >= SUCCESS and good[clear][-LAST:].all()),
        "said_hidden": float((~run.visible[clear]).mean()),
        "jitter": _jitter(centres(boxes) - centres(truth.boxes), clear),
        "outliers": float(run.details["outliers"][trusted].mean()) if trusted.any() else nan,
    }
    known |= _occlusions(events, good & (truth.visibility >= IN_VIEW), truth, trace)
    if SWITCH in truth.attributes:
        off = truth.attributes[SWITCH]
        known |= _at_switches(off, _lost_from(events, first_loss, trace), good, clear)
    return known


def _jitter(errors: NDArray[np.float64], clear: NDArray[np.bool_]) -> float:
    """Mean length of second differences of errors (n, 2) over three clear frames in a row."""
    lengths = np.hypot(*np.diff(errors, 2, axis=0).T)
    chosen = clear[:-2] & clear[1:-1] & clear[2:]
    return float(lengths[chosen].mean()) if chosen.any() else nan


def _occlusions(
    events: list[Declared], found: NDArray[np.bool_], truth: Truth, trace: Trace
) -> dict[str, float]:
    """How those that there were, and those that were declared, fit together.

    `found` are frames in which the box is on a target in view.
    """
    hidden = hidden_in(truth.visibility)
    causes = [[event for event in events if one.causes(event)] for one in hidden]
    declared = [those for those in causes if those]
    ends = [_end(those[-1], trace) for those in declared]
    detected = sum(bool(found[end]) for end in ends if end is not None)
    return {
        "occlusions": float(len(hidden)),
        "declared": float(len(declared)),
        "detected": float(detected),
        "detected_share": detected / len(hidden) if hidden else nan,
        "false_occlusions": float(len(events) - sum(map(len, causes))),
    }


def _end(event: Declared, trace: Trace) -> int | None:
    """The frame whose box shows whether the target was found again."""
    return event.end if trace == "revised" else event.back


def _lost_from(events: list[Declared], first_loss: float, trace: Trace) -> float:
    """Where a loss began: in what was declared an occlusion the tracker follows nothing."""
    for event in events:
        end = _end(event, trace)
        if event.beginning <= first_loss and (end is None or first_loss <= end):
            return event.beginning
    return first_loss


def _at_switches(
    off: NDArray[np.bool_], lost: float, good: NDArray[np.bool_], clear: NDArray[np.bool_]
) -> dict[str, float]:
    changes = np.flatnonzero(np.diff(off.astype(np.int8))) + 1
    at_moment = np.abs(changes - lost) <= MOMENT
    after = np.zeros_like(clear)
    after[changes[0] : changes[0] + KEPT] = True
    return {
        "lost_at_switch": float(at_moment.any()),
        "lost_at_off": float(at_moment[0]),
        "kept_after_off": float(good[after & clear].mean()) if (after & clear).any() else nan,
        "clear_after_off": float((after & clear).sum()),
    }
