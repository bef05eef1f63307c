"""Restarts some frames after every failure (VOT 2013 to 2019).

A tracker fails at a frame with a target if the overlap of its box with the ground truth is at most
`threshold`. The overlap is defined as in the metrics `vot-supervised`: counted in pixels within the
image. A new tracker with its own random numbers is initialised with the ground truth `skip_frames`
frames after the failure, or at the first later frame with a target. The tracker does not receive
the frames in between.

Without a failure, the run equals the one-pass run. The state of each frame is stored: tracked,
failed, skipped or initialised. Ten frames after each initialisation (burn-in) are excluded by the
metrics, not by the protocol. Revised boxes are not stored. Source: Kristan et al., "A novel
performance evaluation methodology for single-target trackers", TPAMI 2016.
"""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.bench.metrics.interface import FrameState, GroundTruthLike
from trackmark.bench.metrics.region_overlap import raster_overlap
from trackmark.bench.protocols import Action, Controller, EvaluationProtocol
from trackmark.trackers.base.parameters import integer


class _RestartController(Controller):
    """Controller that restarts the tracker after a failure."""

    states: NDArray[np.int32]

    def __init__(
        self, truth: GroundTruthLike, first: int, size: tuple[int, int], skip: int, threshold: float
    ) -> None:
        self._truth, self._shapes = truth.boxes, getattr(truth, "shapes", None)
        self._present: NDArray[np.bool_] = np.asarray(np.isfinite(truth.boxes).all(axis=1))
        self._size, self._skip, self._threshold = size, skip, threshold
        self.states = np.full(len(truth.boxes), FrameState.SKIPPED, np.int32)
        self.states[first] = FrameState.INITIALISED
        self._restart_frame = 0  # earliest frame of the next initialisation
        self._failed = False

    def action(self, frame: int) -> Action:
        """See `Controller.action`."""
        if not self._failed:
            return Action.UPDATE
        if frame < self._restart_frame or not self._present[frame]:
            return Action.SKIP
        self._failed = False
        self.states[frame] = FrameState.INITIALISED
        return Action.RESTART

    def check_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.check_estimate`."""
        self.states[frame] = FrameState.TRACKED
        if self._present[frame]:
            shape = None if self._shapes is None else [self._shapes[frame]]
            (overlap,) = raster_overlap(self._truth[frame, None], row[None, :4], self._size, shape)
            if overlap <= self._threshold:
                self.states[frame] = FrameState.FAILED
                self._failed, self._restart_frame = True, frame + self._skip
        return ""


class Supervised(EvaluationProtocol):
    """Supervised protocol."""

    run_kinds: ClassVar[tuple[str, ...]] = ("supervised",)
    metrics: ClassVar[str] = "vot-supervised"

    skip_frames: int = integer(5, "number of frames from a failure to a restart")  # name: option
    threshold: float = Field(
        0.0, ge=0, lt=1, description="maximum overlap that counts as a failure"
    )

    def controller(self, truth: GroundTruthLike, first: int, size: tuple[int, int]) -> Controller:
        """See `EvaluationProtocol.controller`."""
        return _RestartController(truth, first, size, self.skip_frames, self.threshold)


PROTOCOL = Supervised
