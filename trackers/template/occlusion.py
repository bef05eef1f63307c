"""What is remembered of a severe occlusion until its end is known (Nguyen & Smeulders 2002)."""

from typing import NamedTuple

from trackers.base.interface import Image
from trackers.template.matching import Match, Pose

__all__ = ["Candidate", "Occlusion"]


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

    def extrapolated(self, frame: int) -> Pose:
        """Where the target would be, had it gone on as it went."""
        steps = frame - self.beginning + 1
        x, y = (
            value + steps * speed for value, speed in zip(self.last[:2], self.velocity, strict=True)
        )
        return Pose(x, y, self.last.scale)
