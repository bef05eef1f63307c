"""Frames arrive at a fixed rate; late estimates count for later frames.

Frame k arrives k / `fps` seconds after the first one; the clock starts after the initialisation. An
idle tracker gets the newest frame, and is then busy during the update. It does not receive frames
that are replaced by newer ones in the meantime. The estimate for a frame is the newest one that was
complete when the next frame arrived. It was computed on this frame or an earlier one (at first, it
is the init box). Each stored row contains the frame on which its estimate was computed.

The time of an update is wall-clock time without decoding, in a process that runs a single tracker.
Results therefore depend on the machine. The times in `update_seconds` replace measured ones and
make runs repeatable. Revised boxes are not stored. After Li, Wang and Ramanan, "Towards streaming
perception", ECCV 2020. VOT and GOT-10k have real-time experiments with other rules
(docs/protocols.md).
"""

from math import inf
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from trackmark.bench.metrics.interface import GroundTruthLike
from trackmark.bench.protocols import Action, Controller, EvaluationProtocol


class _FrameSkipper(Controller):
    """Controller that skips frames while the tracker is busy; its unit of time is one frame."""

    estimate_frames: NDArray[np.int32]

    def __init__(self, n_frames: int, first: int, fps: float, seconds: list[float]) -> None:
        self.estimate_frames = np.full(n_frames, -1, np.int32)
        self.estimate_frames[first] = first
        self._first, self._fps, self._seconds = first, fps, seconds
        self._free_at = 0.0
        self._complete = first  # frame of the newest complete estimate
        self._pending = first  # frame of the next estimate
        self._n_updates = 0

    def action(self, frame: int) -> Action:
        """See `Controller.action`."""
        now = frame - self._first
        if self._free_at <= now + 1:
            self._complete = self._pending
        self.estimate_frames[frame] = self._complete
        return Action.UPDATE if self._free_at < now + 1 else Action.SKIP

    def check_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.check_estimate`."""
        now = frame - self._first
        if self._seconds:
            seconds = self._seconds[self._n_updates % len(self._seconds)]
        self._n_updates += 1
        self._free_at = max(self._free_at, float(now)) + seconds * self._fps
        self._pending = frame
        if self._free_at <= now + 1:
            self._complete = self.estimate_frames[frame] = frame
        return ""


class RealTime(EvaluationProtocol):
    """Real-time protocol."""

    fps: float = Field(25.0, gt=0, description="frames per second")
    update_seconds: str = Field(
        "", description="times of updates, used in turn, such as 0.02/0.5; measured if empty"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        for number in self._parsed_seconds():
            if not 0 <= number < inf:
                raise ValueError("update_seconds must be numbers ≥ 0, such as 0.02 or 0.02/0.5")
        return self

    @property
    def time_dependent(self) -> bool:
        """See `EvaluationProtocol.time_dependent`."""
        return not self.update_seconds

    def controller(self, truth: GroundTruthLike, first: int, size: tuple[int, int]) -> Controller:
        """See `EvaluationProtocol.controller`."""
        return _FrameSkipper(len(truth.boxes), first, self.fps, self._parsed_seconds())

    def _parsed_seconds(self) -> list[float]:
        return (
            [float(text) for text in self.update_seconds.split("/")] if self.update_seconds else []
        )


PROTOCOL = RealTime
