"""Begun again some frames after every failure (VOT 2013 to 2019).

A tracker has failed at a frame with a target where the overlap of its box with the truth is at or
below a threshold: the overlap of pixels, cut off at the image, that `vot-supervised` judges by. It
is not shown the frames of the pause that follows; `skip` frames after the failure, or as soon
after that as there is a target, another one is begun with the truth, with random numbers of its
own. A tracker that never fails has the run in one pass, to the bit. What is stored says of every
frame whether it was tracked, failed, skipped or given; the ten frames of burn-in after each
beginning are left out by the preset, not here. Boxes that a tracker revises later are not kept.
Kristan et al., "A novel performance evaluation methodology for single-target trackers", TPAMI
2016.
"""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.bench.metrics.native import GroundTruth
from trackmark.bench.metrics.preset import FrameState
from trackmark.bench.metrics.region_overlap import raster_overlap
from trackmark.bench.protocols import Action, Controller, Protocol
from trackmark.trackers.base.parameters import whole


class _Supervision(Controller):
    """Looks at every answer, and has another tracker begun after one that has failed."""

    states: NDArray[np.int32]

    def __init__(
        self, truth: GroundTruth, first: int, size: tuple[int, int], skip: int, threshold: float
    ) -> None:
        self._truth, self._shapes = truth.boxes, getattr(truth, "shapes", None)
        self._present: NDArray[np.bool_] = np.asarray(np.isfinite(truth.boxes).all(axis=1))
        self._size, self._skip, self._threshold = size, skip, threshold
        self.states = np.full(len(truth.boxes), FrameState.SKIPPED, np.int32)
        self.states[first] = FrameState.INITIALISED
        self._again = 0  # frame from which a new tracker may be begun
        self._failed = False

    def action(self, frame: int) -> Action:
        """See `Controller.action`."""
        if not self._failed:
            return Action.UPDATE
        if frame < self._again or not self._present[frame]:
            return Action.SKIP
        self._failed = False
        self.states[frame] = FrameState.INITIALISED
        return Action.RESTART

    def on_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.on_estimate`."""
        self.states[frame] = FrameState.TRACKED
        if self._present[frame]:
            shape = None if self._shapes is None else [self._shapes[frame]]
            (overlap,) = raster_overlap(self._truth[frame, None], row[None, :4], self._size, shape)
            if overlap <= self._threshold:
                self.states[frame] = FrameState.FAILED
                self._failed, self._again = True, frame + self._skip
        return ""


class Supervised(Protocol):
    """Knobs of what a failure is and what follows it."""

    judged: ClassVar[tuple[str, ...]] = ("supervised",)
    preset: ClassVar[str] = "vot-supervised"

    skip: int = whole(5, "frames from a failure to the next beginning")
    threshold: float = Field(
        0.0, ge=0, lt=1, description="overlap at or below which a tracker has failed"
    )

    def controller(self, truth: GroundTruth, first: int, size: tuple[int, int]) -> Controller:
        """See `Protocol.controller`."""
        return _Supervision(truth, first, size, self.skip, self.threshold)


PROTOCOL = Supervised
