"""The occlusions that a run declared, and those that there were."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.trackers.templates.occlusion import FIRST_CANDIDATE, candidate_offsets

CLEAR = 0.9
"""Visible part from which on a frame counts as clear."""

COMPLETE = 0.02
"""Visible part up to which the target is hidden completely."""

STRAIGHT = 1e-7  # pixels, by which steps of an interpolated box may differ
EARLY = 2
"""Frames before the target begins to be hidden from which on an occlusion may be declared."""

Boxes = NDArray[np.float64]


class Declared(NamedTuple):
    """An occlusion that a tracker declared, by frames.

    The first that it did not trust (t_o); where it found the target again (t_e), None where the
    sequence ended too early for that; and when it said so, the first frame whose box is tracked
    again online, None where the sequence was over by then.
    """

    beginning: int
    end: int | None
    back: int | None


class Hidden(NamedTuple):
    """A complete occlusion: first and last frame in a row that are not clear."""

    first: int
    last: int

    def causes(self, event: Declared) -> bool:
        """Whether an occlusion that was declared is this one."""
        return self.first - EARLY <= event.beginning <= self.last


def hidden_in(visibility: NDArray[np.float64]) -> list[Hidden]:
    """Complete occlusions of a sequence, in order, by the target's visible part (n,)."""
    return [
        Hidden(first, last)
        for first, last in _stretches(visibility < CLEAR)
        if visibility[first : last + 1].min() <= COMPLETE
    ]


def declared_in(run: Run) -> list[Declared]:
    """Occlusions that a finished run of `nguyen2002` declared, in order of their beginnings.

    The tracker tells frames in which they began and ended in its details `beginning` and `end`,
    in order, one of each a frame, and in `ended` how many have ended so far; of one that is open
    at the sequence's end, `candidate` is the end. What comes after such a one, or what the
    sequence's end left no frame to tell, has nothing but its revised boxes: up to an occlusion's
    end these go on in equal steps, and then no more. Of what is declared there in the very last
    frames nothing is known, but that it may go on in the same steps: then the end is read too late.
    """
    details = run.details
    beginnings, ends = _told(details["beginning"]), _told(details["end"])
    number = np.nan_to_num(details["ended"])
    backs = np.searchsorted(number, np.arange(1, number[-1] + 1)).tolist()
    events = [Declared(*event) for event in zip(beginnings, ends, backs, strict=False)]
    boxes, parameters = run.boxes_in("revised"), run.identity.parameters
    offsets = candidate_offsets(int(parameters["longest_occlusion"]), str(parameters["candidates"]))
    untold, is_open = iter(beginnings[len(events) :]), details["occluded"][-1] == 1
    while len(events) < len(backs) or is_open:
        beginning = next(untold, None) or _next_beginning(boxes, events)
        if beginning is None:
            break
        end, back = _end(boxes, beginning, offsets), None
        if len(events) < len(backs):
            back = backs[len(events)]
        elif len(events) == len(backs):
            end = next(iter(_told(details["candidate"][-1:])), None)
        events.append(Declared(beginning, end, back))
    return events


def _told(frames: NDArray[np.float64]) -> list[int]:
    told: list[int] = frames[np.isfinite(frames)].astype(int).tolist()
    return told


def _end(boxes: Boxes, beginning: int, offsets: list[int]) -> int | None:
    on_the_line = _straight(boxes, beginning)
    reached = [offset for offset in offsets if offset <= on_the_line]
    return beginning + reached[-1] if reached else None


def _straight(boxes: Boxes, beginning: int) -> int:
    """How many frames after a frame the box goes on as it came to this one."""
    steps = np.diff(boxes[beginning - 1 :], axis=0)
    others = np.flatnonzero((np.abs(steps - steps[0]) > STRAIGHT).any(axis=1))
    return int(others[0] if len(others) else len(steps)) - 1


def _next_beginning(boxes: Boxes, events: list[Declared]) -> int | None:
    """Where an occlusion began after some others of which only the boxes can tell."""
    after = events[-1].end
    frames = range(len(boxes) if after is None else after + 1, len(boxes))
    return next((frame for frame in frames if _straight(boxes, frame) >= FIRST_CANDIDATE), None)


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last frame of all stretches of frames that are flagged."""
    changes = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return [(int(first), int(end) - 1) for first, end in changes.reshape(-1, 2)]
