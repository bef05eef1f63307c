"""What is remembered of a severe occlusion until its end is known (Nguyen & Smeulders 2002)."""

from collections import deque
from math import nan
from typing import NamedTuple

from trackmark.trackers.base.interface import Image
from trackmark.trackers.templates.matching import Match, Pose

FIRST_CANDIDATE = 5  # frames from an occlusion's beginning to the first that may be its end


def visited(longest: int, candidates: str) -> list[int]:
    """Frames after an occlusion's beginning that may be its end (section 2.4), none later than L.

    `all`, or `skipped`: 5, 7, 11, 19, 35 and so on, in steps that double.

    Examples
    --------
    >>> visited(40, "skipped"), visited(4, "skipped")
    ([5, 7, 11, 19, 35], [])
    """
    if candidates == "all":
        return list(range(FIRST_CANDIDATE, longest + 1))
    offsets, offset, step = [], FIRST_CANDIDATE, 2
    while offset <= longest:
        offsets.append(offset)
        offset, step = offset + step, 2 * step
    return offsets


class Candidate(NamedTuple):
    """A frame that may be the end of an occlusion, so many frames after its beginning."""

    offset: int
    match: Match
    share: float


class Occlusion:
    """What is remembered while the target is hidden: from where, and all frames since."""

    def __init__(self, beginning: int, last: Pose, velocity: tuple[float, float]) -> None:
        self.beginning = beginning
        self.last = last
        self.velocity = velocity
        self.images: list[Image] = []
        self.candidates: list[Candidate] = []

    @property
    def best(self) -> Candidate:
        """The candidate of least cost."""
        return min(self.candidates, key=lambda candidate: candidate.match.cost)

    @property
    def ends_by_now(self) -> float:
        """The frame that ends it if no better candidate comes; NaN before the first one."""
        return self.beginning + self.best.offset if self.candidates else nan

    def extrapolated(self, frame: int) -> Pose:
        """Where the target would be, had it gone on as it went."""
        steps = frame - self.beginning + 1
        x, y = (
            value + steps * speed for value, speed in zip(self.last[:2], self.velocity, strict=True)
        )
        return Pose(x, y, self.last.scale)


class Diary:
    """Frames in which occlusions began and ended, told in order, one of each a frame."""

    def __init__(self) -> None:
        self._beginnings: deque[int] = deque()
        self._ends: deque[int] = deque()
        self._ended = 0

    def begins(self, frame: int) -> None:
        """Note the first frame of an occlusion."""
        self._beginnings.append(frame)

    def ends(self, frame: int) -> None:
        """Note the frame in which the target is back."""
        self._ends.append(frame)
        self._ended += 1

    def told(self) -> dict[str, float]:
        """`beginning` and `end`, the next of each (NaN for none), and `ended`: ends so far."""
        return {
            "beginning": float(self._beginnings.popleft()) if self._beginnings else nan,
            "end": float(self._ends.popleft()) if self._ends else nan,
            "ended": float(self._ended),
        }
