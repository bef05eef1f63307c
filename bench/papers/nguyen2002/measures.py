"""Measures of the template tracker: tracked clips, detected occlusions, losses at a lamp's switch.

The paper's tracker looks ahead for the end of an occlusion. Measures therefore use revised boxes.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.sets.native import SUCCESS_OVERLAP, first_loss
from trackmark.bench.papers.measures import MeasuredRun, Values, inside, measure
from trackmark.bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in

SUCCESS = 0.9  # minimum share of clear frames with sufficient overlap in a tracked clip
LAST = 5  # number of last clear frames, in all of which the overlap is sufficient

IN_VIEW = 0.75  # minimum visible share of a target that can be re-detected
SWITCH = "lamp off"  # attribute of frames with a lamp switched off
MOMENT = 3  # frames before and after a switch in which a loss counts
AFTER = 20  # frames after a lamp is switched off that are measured


def overlaps(measured: MeasuredRun) -> Values:
    """Return 1 in frames with an overlap of 0.5 or more, else 0, shape (n,)."""
    return np.asarray(measured.overlap >= SUCCESS_OVERLAP, np.float64)


@measure("share")
def kept_in_clip(measured: MeasuredRun) -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the clear frames and in the last five."""
    tracked = measured.on_target[_clear(measured)]
    return float(tracked.mean() >= SUCCESS and bool(tracked[-LAST:].all()))


@measure("share", averaged=True)
def tracked_frames(measured: MeasuredRun) -> float:
    """Return the share of the clear frames in which the overlap is 0.5 or more."""
    return float(measured.on_target[_clear(measured)].mean())


@measure("occlusions")
def detected(measured: MeasuredRun) -> float:
    """Return the number of complete occlusions that are declared and followed by a re-detection."""
    recovered = measured.on_target & (measured.truth.visibility >= IN_VIEW)
    events = _events(measured)
    count = 0
    for hidden in hidden_in(measured.truth.visibility):
        causes = [event for event in events if hidden.causes(event)]
        end = causes[-1].end if causes else None
        count += end is not None and bool(recovered[end])
    return float(count)


@measure("share")
def most_detected(measured: MeasuredRun) -> float:
    """Return 1 if more than half of the complete occlusions are detected, else 0."""
    return float(detected(measured) > len(hidden_in(measured.truth.visibility)) / 2)


@measure("share")
def lost_at_switch(measured: MeasuredRun) -> float:
    """Return 1 if the first loss of the target is within three frames of a lamp's switch.

    A loss during a declared occlusion counts from its beginning: the tracker does not track in it.
    """
    lost = float(first_loss(inside(measured) > 0, measured.present, measured.truth.visibility))
    for event in _events(measured):
        if event.beginning <= lost and (event.end is None or lost <= event.end):
            lost = event.beginning
            break
    off = measured.truth.attributes[SWITCH].astype(np.int8)
    switches = np.flatnonzero(np.diff(off)) + 1
    return float((np.abs(switches - lost) <= MOMENT).any())


@measure("share")
def stays_at_switch(measured: MeasuredRun) -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the 20 frames after a lamp goes off."""
    off = int(np.argmax(measured.truth.attributes[SWITCH]))
    after = slice(off, off + AFTER)
    return float(measured.on_target[after][_clear(measured)[after]].mean() >= SUCCESS)


def _clear(measured: MeasuredRun) -> NDArray[np.bool_]:
    """Return the clear frames after the init frame."""
    clear = np.asarray(measured.truth.visibility >= CLEAR)
    clear[0] = False
    return clear


def _events(measured: MeasuredRun) -> list[Declared]:
    return [] if measured.record.failure else declared_in(measured.record)
