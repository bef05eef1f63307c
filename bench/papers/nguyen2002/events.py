"""Occlusions that a run declared, and complete occlusions in the ground truth."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.trackers.templates.occlusion import FIRST_CANDIDATE, candidate_offsets

CLEAR = 0.9
"""Minimum visible share of the target in a clear frame."""

COMPLETE = 0.02
"""Largest visible share of a completely hidden target."""

STRAIGHT = 1e-7  # largest difference between steps of an interpolated box [px]
EARLY = 2
"""Number of frames before an occlusion in which it may already be declared."""

Boxes = NDArray[np.float64]


class Declared(NamedTuple):
    """Occlusion that a tracker declared.

    `beginning`: first frame with a declared occlusion (t_o). `end`: frame of the re-detection
    (t_e); None if the sequence ends before.
    """

    beginning: int
    end: int | None


class Hidden(NamedTuple):
    """Complete occlusion, from the first to the last of consecutive frames that are not clear."""

    first: int
    last: int

    def causes(self, event: Declared) -> bool:
        """Return whether a declared occlusion corresponds to this one."""
        return self.first - EARLY <= event.beginning <= self.last


def hidden_in(visibility: NDArray[np.float64]) -> list[Hidden]:
    """Return the complete occlusions of a sequence, in order; `visibility`: shape (n,)."""
    return [
        Hidden(first, last)
        for first, last in _stretches(visibility < CLEAR)
        if visibility[first : last + 1].min() <= COMPLETE
    ]


def declared_in(run: Run) -> list[Declared]:
    """Return the occlusions that a finished run of `nguyen2002` declared, in order of beginning.

    The details of a run contain at most one `beginning` and one `end` per frame, which lag behind
    the events, and the number `ended` of occlusions so far. `candidate` is the end of an occlusion
    that is open when the sequence ends. Occlusions that are missing in the details are detected in
    the revised boxes, which move in equal steps during an occlusion. Their detected end is too late
    if the box continues in equal steps after the occlusion.
    """
    details = run.details
    beginnings, ends = _finite_frames(details["beginning"]), _finite_frames(details["end"])
    n_ended = int(np.nan_to_num(details["ended"])[-1])
    events = [Declared(*event) for event in zip(beginnings[:n_ended], ends, strict=False)]
    boxes, parameters = run.boxes_in("revised"), run.identity.parameters
    offsets = candidate_offsets(int(parameters["longest_occlusion"]), str(parameters["candidates"]))
    unreported, is_open = iter(beginnings[len(events) :]), details["occluded"][-1] == 1
    while len(events) < n_ended or is_open:
        beginning = next(unreported, None) or _next_beginning(boxes, events)
        if beginning is None:
            break
        end = _end(boxes, beginning, offsets)
        if len(events) == n_ended:
            end = next(iter(_finite_frames(details["candidate"][-1:])), None)
        events.append(Declared(beginning, end))
    return events


def _finite_frames(frames: NDArray[np.float64]) -> list[int]:
    finite: list[int] = frames[np.isfinite(frames)].astype(int).tolist()
    return finite


def _end(boxes: Boxes, beginning: int, offsets: list[int]) -> int | None:
    on_the_line = _straight(boxes, beginning)
    reached = [offset for offset in offsets if offset <= on_the_line]
    return beginning + reached[-1] if reached else None


def _straight(boxes: Boxes, beginning: int) -> int:
    """Return for how many frames after `beginning` the steps of the box are equal."""
    steps = np.diff(boxes[beginning - 1 :], axis=0)
    others = np.flatnonzero((np.abs(steps - steps[0]) > STRAIGHT).any(axis=1))
    return int(others[0] if len(others) else len(steps)) - 1


def _next_beginning(boxes: Boxes, events: list[Declared]) -> int | None:
    """Return the beginning of the next occlusion after `events`, detected by equal steps."""
    after = events[-1].end
    frames = range(len(boxes) if after is None else after + 1, len(boxes))
    return next((frame for frame in frames if _straight(boxes, frame) >= FIRST_CANDIDATE), None)


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last frame of each stretch of consecutive flagged frames."""
    changes = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return [(int(first), int(end) - 1) for first, end in changes.reshape(-1, 2)]
