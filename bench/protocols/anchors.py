"""From each of many anchors, forwards or backwards (VOT 2020 to 2022).

Anchors are the frames that the data name by the value `anchor` (above 0 forwards, below
backwards), where they bring one. Elsewhere they lie about `spacing` frames apart, from the first
frame with a target to the last; one without a target moves on to the next that has one. From an
anchor the tracker goes to that end of the sequence which is further away, so that a segment
backwards ends with frame 0. Each is a segment with a tracker, and random numbers, of its own.
Kristan et al., "The eighth visual object tracking VOT2020 challenge results", ECCV workshops 2020.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.protocols import Protocol, Segment
from trackmark.trackers.base.parameters import whole

_VALUE = "anchor"


class Anchors(Protocol):
    """Knobs of where anchors lie."""

    judged: ClassVar[tuple[str, ...]] = ("anchors", "one pass")
    preset: ClassVar[str] = "vot-anchor"
    by_values: ClassVar[bool] = True

    spacing: int = whole(50, "frames between anchors, where the data name none")

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `Protocol.segments`."""
        frames = np.flatnonzero(present)
        given = np.where(present, np.nan_to_num(values.get(_VALUE, np.zeros(len(present)))), 0.0)
        first, last = int(frames[0]), int(frames[-1])
        if given.any():
            named = np.flatnonzero(given).tolist()
            return [_from(frame, bool(given[frame] > 0), first) for frame in named]
        count = max(round((last - first) / self.spacing), 1)
        places = np.round(np.linspace(first, last, count + 1))
        anchors = np.unique(frames[np.searchsorted(frames, places)])
        before, after = anchors, len(present) - 1 - anchors
        return [
            _from(anchor, forwards, first)
            for anchor, forwards in zip(anchors.tolist(), after >= before, strict=True)
        ]


def _from(anchor: int, forwards: bool, first: int) -> Segment:
    if forwards:
        return Segment(0 if anchor == first else anchor)
    return Segment(anchor, -1)


PROTOCOL = Anchors
