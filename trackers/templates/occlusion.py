"""State of a severe occlusion until its end is known (Nguyen & Smeulders 2002)."""

from collections import deque
from math import nan
from typing import NamedTuple

from trackmark.trackers.base.interface import Image
from trackmark.trackers.templates.matching import Match, Pose

FIRST_CANDIDATE = 5  # frames from an occlusion's beginning to the first that may be its end


def candidate_offsets(longest: int, candidates: str) -> list[int]:
    """Return the numbers of frames, up to `longest`, after which an occlusion may end.

    `all`: all numbers ≥ 5. `skipped` (section 2.4): 5, 7, 11, 19, 35 and so on, in steps that
    double.

    Examples
    --------
    >>> candidate_offsets(40, "skipped"), candidate_offsets(4, "skipped")
    ([5, 7, 11, 19, 35], [])
    """
    if candidates == "all":
        return list(range(FIRST_CANDIDATE, longest + 1))
    offsets, offset, step = [], FIRST_CANDIDATE, 2
    while offset <= longest:
        offsets.append(offset)
        offset, step = offset + step, 2 * step
    return offsets


class EndCandidate(NamedTuple):
    """Frame that may be the end of an occlusion."""

    offset: int  # frames since the beginning
    match: Match
    share: float  # share of outliers


class Occlusion:
    """Open occlusion: first frame, last pose, velocity [pixels/frame], and all frames since."""

    def __init__(self, beginning: int, last: Pose, velocity: tuple[float, float]) -> None:
        self.beginning = beginning
        self.last = last
        self.velocity = velocity
        self.images: list[Image] = []
        self.candidates: list[EndCandidate] = []

    @property
    def best(self) -> EndCandidate:
        """Candidate of minimum cost."""
        return min(self.candidates, key=lambda candidate: candidate.match.cost)

    @property
    def current_end(self) -> float:
        """Frame of the best candidate so far; NaN before the first candidate."""
        return self.beginning + self.best.offset if self.candidates else nan

    def extrapolate(self, frame: int) -> Pose:
        """Return the pose in a frame, extrapolated at constant velocity."""
        steps = frame - self.beginning + 1
        x, y = (
            value + steps * speed for value, speed in zip(self.last[:2], self.velocity, strict=True)
        )
        return Pose(x, y, self.last.scale)


class OcclusionLog:
    """Queue of frames in which occlusions began and ended, to be reported one per frame."""

    def __init__(self) -> None:
        self._beginnings: deque[int] = deque()
        self._ends: deque[int] = deque()
        self._ended = 0

    def record_beginning(self, frame: int) -> None:
        """Add the first frame of an occlusion."""
        self._beginnings.append(frame)

    def record_end(self, frame: int) -> None:
        """Add the first frame after an occlusion."""
        self._ends.append(frame)
        self._ended += 1

    def next_events(self) -> dict[str, float]:
        """Return the next `beginning` and `end` (NaN for none), and the number of ends so far."""
        return {
            "beginning": float(self._beginnings.popleft()) if self._beginnings else nan,
            "end": float(self._ends.popleft()) if self._ends else nan,
            "ended": float(self._ended),
        }
