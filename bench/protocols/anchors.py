"""Segments from many anchor frames, forwards or backwards (VOT 2020 to 2022).

If the sequence has values named `anchor`, frames with a target and a value other than 0 are the
anchors: the tracker runs forwards from values above 0, and backwards from values below 0.
Otherwise, anchors lie about `spacing` frames apart, from the first frame with a target to the last
one. An anchor without target is moved to the next frame with a target. From there, the tracker runs
to the more distant end of the sequence. A backward segment ends with frame 0. Each segment has its
own tracker and random numbers. Source: Kristan et al., "The eighth visual object tracking VOT2020
challenge results", ECCV workshops 2020.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.protocols import EvaluationProtocol, Segment
from trackmark.trackers.base.parameters import integer

_VALUE = "anchor"


class Anchors(EvaluationProtocol):
    """Anchor-based protocol."""

    run_kinds: ClassVar[tuple[str, ...]] = ("anchors", "one-pass")
    metrics: ClassVar[str] = "vot-anchor"
    has_segments: ClassVar[bool] = True

    spacing: int = integer(
        50, "number of frames between anchors, if the sequence defines no anchors"
    )

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `EvaluationProtocol.segments`."""
        frames = np.flatnonzero(present)
        marks = np.where(present, np.nan_to_num(values.get(_VALUE, np.zeros(len(present)))), 0.0)
        first, last = int(frames[0]), int(frames[-1])
        if marks.any():
            anchors = np.flatnonzero(marks)
            forwards = marks[anchors] > 0
        else:
            count = max(round((last - first) / self.spacing), 1)
            positions = np.round(np.linspace(first, last, count + 1))
            anchors = np.unique(frames[np.searchsorted(frames, positions)])
            forwards = len(present) - 1 - anchors >= anchors
        # Start 0 stands for the first frame with a target.
        return [
            Segment(0 if anchor == first else anchor) if is_forward else Segment(anchor, -1)
            for anchor, is_forward in zip(anchors.tolist(), forwards.tolist(), strict=True)
        ]


PROTOCOL = Anchors
