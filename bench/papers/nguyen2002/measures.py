"""Measures of runs of the template tracker: tracked clips, detected occlusions, lost at a switch.

`trace=online` takes the boxes that the tracker gave at once; the paper's results are of the revised
ones, as its tracker looks ahead for the end of an occlusion.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import SUCCESS_OVERLAP, first_loss
from trackmark.bench.papers.measures import SERIES as COMMON_SERIES
from trackmark.bench.papers.measures import Course, Values, measure
from trackmark.bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in

SUCCESS, LAST = 0.9, 5
"""A clip is tracked with enough overlap in this share of its clear frames and in the last ones."""

IN_VIEW = 0.75  # visible share from which on a target can be found again
SWITCH = "lamp off"  # attribute of frames in which one of the lamps is off
MOMENT = 3  # frames before and after a switch
AFTER = 20  # frames after a lamp goes off in which the box must stay


def _overlaps(course: Course) -> Values:
    return np.asarray(course.overlap >= SUCCESS_OVERLAP, np.float64)


SERIES = {"overlaps": _overlaps}


@measure("share")
def kept(course: Course, trace: str = "") -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the clear frames and in the last five."""
    course = course.in_trace(trace)
    on = course.on_target[_clear(course)]
    return float(on.mean() >= SUCCESS and bool(on[-LAST:].all()))


@measure("occlusions")
def detected(course: Course, trace: str = "") -> float:
    """Return the number of complete occlusions that are declared and end on the target."""
    course = course.in_trace(trace)
    found = course.on_target & (course.truth.visibility >= IN_VIEW)
    events = _events(course)
    count = 0
    for hidden in hidden_in(course.truth.visibility):
        causes = [event for event in events if hidden.causes(event)]
        end = _end(causes[-1], course) if causes else None
        count += end is not None and bool(found[end])
    return float(count)


@measure("share")
def most_detected(course: Course) -> float:
    """Return 1 if more than half of the complete occlusions are detected."""
    return float(detected(course) > len(hidden_in(course.truth.visibility)) / 2)


@measure("share")
def lost_at_switch(course: Course) -> float:
    """Return 1 if the target is first lost within three frames of a switch of a lamp.

    A loss within a declared occlusion began with it, as the tracker follows nothing meanwhile.
    """
    inside = COMMON_SERIES["inside"](course) > 0
    lost = float(first_loss(inside, course.present, course.truth.visibility))
    for event in _events(course):
        end = _end(event, course)
        if event.beginning <= lost and (end is None or lost <= end):
            lost = event.beginning
            break
    off = course.truth.attributes[SWITCH].astype(np.int8)
    switches = np.flatnonzero(np.diff(off)) + 1
    return float((np.abs(switches - lost) <= MOMENT).any())


@measure("share")
def stays_at_switch(course: Course) -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the 20 frames after a lamp goes off."""
    off = int(np.argmax(course.truth.attributes[SWITCH]))
    after = slice(off, off + AFTER)
    return float(course.on_target[after][_clear(course)[after]].mean() >= SUCCESS)


def _clear(course: Course) -> NDArray[np.bool_]:
    """Return frames that show the target clearly; the first is given."""
    clear = np.asarray(course.truth.visibility >= CLEAR)
    clear[0] = False
    return clear


def _events(course: Course) -> list[Declared]:
    return [] if course.run.failure else declared_in(course.run)


def _end(event: Declared, course: Course) -> int | None:
    """Return the frame whose box shows whether the target was found again."""
    return event.end if course.description.trace == "revised" else event.back
