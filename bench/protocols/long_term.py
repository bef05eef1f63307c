"""One-pass run of a tracker that reports a confidence (VOT long-term).

The target may leave and return, and the tracker is never restarted. Precision, recall and F-measure
depend on the confidence. A run therefore fails if the tracker reports a visible target without a
confidence. Revised boxes are not stored. Source: Lukežič et al., "Now you see me: evaluating
performance in long-term visual tracking", 2018.
"""

from math import isnan
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.interface import GroundTruthLike
from trackmark.bench.protocols import Controller, EvaluationProtocol


class _ConfidenceCheck(Controller):
    """Controller that ends a run at a visible estimate without confidence."""

    def check_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """See `Controller.check_estimate`."""
        _, _, _, _, visible, confidence = row.tolist()
        if visible and isnan(confidence):
            return (
                "the estimate has no confidence, which the protocol long-term needs; use the "
                "protocol one-pass"
            )
        return ""


class LongTerm(EvaluationProtocol):
    """Protocol without parameters."""

    metrics: ClassVar[str] = "long-term"

    def controller(self, truth: GroundTruthLike, first: int, size: tuple[int, int]) -> Controller:
        """See `EvaluationProtocol.controller`."""
        return _ConfidenceCheck()


PROTOCOL = LongTerm
