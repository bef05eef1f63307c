"""From each of several frames to the end: temporal robustness (TRE).

The starts lie at equal distances among the frames that have a target and at least `least` frames
to the end, the first and the last of them included; where there are fewer such frames than starts,
all are starts. Each start is a segment with a tracker, and random numbers, of its own; the first
is the run in one pass to the bit. A score is the mean over segments. Wu, Lim and Yang, "Online
object tracking: a benchmark", CVPR 2013.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.protocols import Protocol, Segment
from trackmark.trackers.base.parameters import whole


class TemporalRobustness(Protocol):
    """Knobs of where it starts."""

    starts: int = whole(20, "starts, at most")
    least: int = whole(20, "frames of the shortest segment", least=2)

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `Protocol.segments`."""
        frames = np.flatnonzero(present)
        frames = frames[(frames <= len(present) - self.least) | (frames == frames[0])]
        count = min(self.starts, len(frames))
        places = np.arange(count) * (len(frames) - 1) // max(count - 1, 1)
        later = [Segment(start) for start in frames[places[1:]].tolist()]
        return [Segment(), *later]


PROTOCOL = TemporalRobustness
