"""Once over the sequence, by a tracker that says how sure it is (VOT long-term).

The run is that in one pass: the target may go and come back, and nobody begins the tracker again.
But precision, recall and F are read off its confidences; so a tracker fails at a frame in which it
reports the target without one. Boxes that a tracker revises later are not kept. Lukežič et al.,
"Now you see me: evaluating performance in long-term visual tracking", 2018.
"""

from math import isnan
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import GroundTruth
from trackmark.bench.protocols import Controller, Protocol


class _Sure(Controller):
    """Fails a run at a box without confidence."""

    def on_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.on_estimate`."""
        _, _, _, _, visible, confidence = row.tolist()
        if visible and isnan(confidence):
            return (
                "it gave no confidence, which the protocol long-term judges by; run it by one-pass"
            )
        return ""


class LongTerm(Protocol):
    """Protocol without knobs."""

    preset: ClassVar[str] = "long-term"

    def controller(self, truth: GroundTruth, first: int, size: tuple[int, int]) -> Controller:
        """See `Protocol.controller`."""
        return _Sure()


PROTOCOL = LongTerm
