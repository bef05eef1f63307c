"""Measures of runs of the template tracker: tracked clips, detected occlusions, lost at a switch.

`trace=online` takes the boxes that the tracker gave at once; the paper's results are of the revised
ones, as its tracker looks ahead for the end of an occlusion.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import SUCCESS_OVERLAP, first_loss
from trackmark.bench.papers.measures import SERIES as COMMON_SERIES
from trackmark.bench.papers.measures import JudgedRun, Values, measure
from trackmark.bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in

SUCCESS, LAST = 0.9, 5
"""A clip is tracked with enough overlap in this share of its clear frames and in the last ones."""

IN_VIEW = 0.75  # visible share from which on a target can be found again
SWITCH = "lamp off"  # attribute of frames in which one of the lamps is off
MOMENT = 3  # frames before and after a switch
AFTER = 20  # frames after a lamp goes off in which the box must stay


def _overlaps(judged: JudgedRun) -> Values:
    return np.asarray(judged.overlap >= SUCCESS_OVERLAP, np.float64)


SERIES = {"overlaps": _overlaps}


@measure("share")
def kept(judged: JudgedRun, trace: str = "") -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the clear frames and in the last five."""
    judged = judged.in_trace(trace)
    on = judged.on_target[_clear(judged)]
    return float(on.mean() >= SUCCESS and bool(on[-LAST:].all()))


@measure("occlusions")
def detected(judged: JudgedRun, trace: str = "") -> float:
    """Return the number of complete occlusions that are declared and end on the target."""
    judged = judged.in_trace(trace)
    recovered = judged.on_target & (judged.truth.visibility >= IN_VIEW)
    events = _events(judged)
    count = 0
    for hidden in hidden_in(judged.truth.visibility):
        causes = [event for event in events if hidden.causes(event)]
        end = _end(causes[-1], judged) if causes else None
        count += end is not None and bool(recovered[end])
    return float(count)


@measure("share")
def most_detected(judged: JudgedRun) -> float:
    """Return 1 if more than half of the complete occlusions are detected."""
    return float(detected(judged) > len(hidden_in(judged.truth.visibility)) / 2)


@measure("share")
def lost_at_switch(judged: JudgedRun) -> float:
    """Return 1 if the target is first lost within three frames of a switch of a lamp.

    A loss within a declared occlusion began with it, as the tracker follows nothing meanwhile.
    """
    inside = COMMON_SERIES["inside"](judged) > 0
    lost = float(first_loss(inside, judged.present, judged.truth.visibility))
    for event in _events(judged):
        end = _end(event, judged)
        if event.beginning <= lost and (end is None or lost <= end):
            lost = event.beginning
            break
    off = judged.truth.attributes[SWITCH].astype(np.int8)
    switches = np.flatnonzero(np.diff(off)) + 1
    return float((np.abs(switches - lost) <= MOMENT).any())


@measure("share")
def stays_at_switch(judged: JudgedRun) -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the 20 frames after a lamp goes off."""
    off = int(np.argmax(judged.truth.attributes[SWITCH]))
    after = slice(off, off + AFTER)
    return float(judged.on_target[after][_clear(judged)[after]].mean() >= SUCCESS)


def _clear(judged: JudgedRun) -> NDArray[np.bool_]:
    """Return frames that show the target clearly; the first is given."""
    clear = np.asarray(judged.truth.visibility >= CLEAR)
    clear[0] = False
    return clear


def _events(judged: JudgedRun) -> list[Declared]:
    return [] if judged.run.failure else declared_in(judged.run)


def _end(event: Declared, judged: JudgedRun) -> int | None:
    """Return the frame whose box shows whether the target was found again."""
    return event.end if judged.description.trace == "revised" else event.back
