"""Measures of the template tracker: tracked clips, detected occlusions, losses at a lamp's switch.

The paper's tracker looks ahead for the end of an occlusion. Measures therefore use revised boxes;
`trace=online` selects the online boxes instead.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import SUCCESS_OVERLAP, first_loss
from trackmark.bench.papers.measures import SERIES as COMMON_SERIES
from trackmark.bench.papers.measures import JudgedRun, measure
from trackmark.bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in

SUCCESS = 0.9  # minimum share of clear frames with sufficient overlap in a tracked clip
LAST = 5  # number of last clear frames, in all of which the overlap is sufficient

IN_VIEW = 0.75  # minimum visible share of a target that can be re-detected
SWITCH = "lamp off"  # attribute of frames with a lamp switched off
MOMENT = 3  # frames before and after a switch in which a loss counts
AFTER = 20  # frames after a lamp is switched off that are measured


SERIES = {"overlaps": lambda judged: np.asarray(judged.overlap >= SUCCESS_OVERLAP, np.float64)}


@measure("share")
def kept(judged: JudgedRun, trace: str = "") -> float:
    """Return 1 if the overlap is 0.5 or more in 90 % of the clear frames and in the last five."""
    judged = judged.in_trace(trace)
    on = judged.on_target[_clear(judged)]
    return float(on.mean() >= SUCCESS and bool(on[-LAST:].all()))


@measure("occlusions")
def detected(judged: JudgedRun, trace: str = "") -> float:
    """Return the number of complete occlusions that are declared and followed by a re-detection."""
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
    """Return 1 if more than half of the complete occlusions are detected, else 0."""
    return float(detected(judged) > len(hidden_in(judged.truth.visibility)) / 2)


@measure("share")
def lost_at_switch(judged: JudgedRun) -> float:
    """Return 1 if the first loss of the target is within three frames of a lamp's switch.

    A loss during a declared occlusion counts from its beginning: the tracker does not track in it.
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
    """Return the clear frames after the init frame."""
    clear = np.asarray(judged.truth.visibility >= CLEAR)
    clear[0] = False
    return clear


def _events(judged: JudgedRun) -> list[Declared]:
    return [] if judged.run.failure else declared_in(judged.run)


def _end(event: Declared, judged: JudgedRun) -> int | None:
    """Return the frame in which a re-detection is tested."""
    return event.end if judged.description.trace == "revised" else event.back
