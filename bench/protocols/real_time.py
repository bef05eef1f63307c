"""While frames come at their own pace: late answers stand for later frames.

Frame k comes k / `fps` seconds after the first one, and the clock starts when the tracker has been
initialised. A tracker that is free takes the newest frame that has come, and is busy for as long
as its answer takes. What stands for a frame is the newest answer that was there before the next
frame came: its own, or that of an earlier frame (at first the given box). Frames that come and go
while the tracker is busy it never sees. What is stored says for every frame whose answer stands
there. The time is what an update takes by the wall clock, without decoding, in a process that runs
nothing else; so runs differ from machine to machine. With `seconds` given the answers take that
long instead, whatever the clock says, and runs are repeatable. Boxes that a tracker revises later
are not kept. After Li, Wang and Ramanan, "Towards streaming perception", ECCV 2020; VOT and
GOT-10k have experiments of this name whose rules differ (docs/protocols.md).
"""

from math import inf
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from trackmark.bench.metrics.native import GroundTruth
from trackmark.bench.protocols import Action, Controller, Protocol


class _Clock(Controller):
    """Time at which a tracker is free, and its newest estimate; times are in frames."""

    source_frames: NDArray[np.int32]

    def __init__(self, frames: int, first: int, fps: float, seconds: list[float]) -> None:
        self.source_frames = np.full(frames, -1, np.int32)
        self.source_frames[first] = first
        self._first, self._fps, self._seconds = first, fps, seconds
        self._free = 0.0  # when the tracker is free
        self._there, self._coming = first, first  # frames of the newest answer, and of the next one
        self._asked = 0

    def action(self, frame: int) -> Action:
        """See `Controller.action`."""
        now = frame - self._first
        if self._free <= now + 1:
            self._there = self._coming
        self.source_frames[frame] = self._there
        return Action.UPDATE if self._free < now + 1 else Action.SKIP

    def on_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.on_estimate`."""
        now = frame - self._first
        took = self._seconds[self._asked % len(self._seconds)] if self._seconds else seconds
        self._asked += 1
        self._free = max(self._free, float(now)) + took * self._fps
        self._coming = frame
        if self._free <= now + 1:
            self._there = self.source_frames[frame] = frame
        return ""


class RealTime(Protocol):
    """Knobs of the pace."""

    fps: float = Field(25.0, gt=0, description="frames that come a second")
    seconds: str = Field("", description="what updates take in turn, as 0.02/0.5; else measured")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for number in self._given():
            if not 0 <= number < inf:
                raise ValueError("seconds are numbers of 0 or more, as 0.02 or 0.02/0.5")
        return self

    @property
    def time_dependent(self) -> bool:
        """See `Protocol.time_dependent`."""
        return not self.seconds

    def controller(self, truth: GroundTruth, first: int, size: tuple[int, int]) -> Controller:
        """See `Protocol.controller`."""
        return _Clock(len(truth.boxes), first, self.fps, self._given())

    def _given(self) -> list[float]:
        return [float(text) for text in self.seconds.split("/")] if self.seconds else []


PROTOCOL = RealTime
