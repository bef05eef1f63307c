"""Runs from several start frames: temporal robustness evaluation (TRE).

The start frames are evenly spaced among the frames with a target from which at least `min_frames`
frames remain. The first and the last of these frames are included. If there are fewer such frames
than `starts`, all of them are start frames. Each segment has its own tracker and random numbers;
the first segment equals the one-pass run. A score is the mean over segments. Source: Wu, Lim, Yang,
"Online object tracking: a benchmark", CVPR 2013.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.protocols import EvaluationProtocol, Segment
from trackmark.trackers.base.parameters import integer


class TemporalRobustness(EvaluationProtocol):
    """Protocol of temporal robustness evaluation."""

    has_segments: ClassVar[bool] = True

    starts: int = integer(20, "maximum number of start frames")
    min_frames: int = integer(20, "minimum length of a segment [frames]", minimum=2)

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `EvaluationProtocol.segments`."""
        frames = np.flatnonzero(present)
        frames = frames[(frames <= len(present) - self.min_frames) | (frames == frames[0])]
        count = min(self.starts, len(frames))
        indices = np.arange(count) * (len(frames) - 1) // max(count - 1, 1)
        return [Segment(), *(Segment(start) for start in frames[indices[1:]].tolist())]


PROTOCOL = TemporalRobustness
