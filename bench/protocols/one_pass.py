"""One pass over the sequence without restarts (OPE).

The tracker is initialised with the ground truth of the first frame in which the target is present,
and updated in every later frame. The tracker is never corrected. This is the default protocol.
Source: Wu, Lim and Yang, "Online object tracking: a benchmark", CVPR 2013.
"""

from typing import ClassVar

from trackmark.bench.protocols import STORED_ONE_PASS, Protocol


class OnePass(Protocol):
    """Protocol without parameters."""

    judged: ClassVar[tuple[str, ...]] = ("one pass", "supervised", "anchors")

    @property
    def text(self) -> str:
        """Name under which runs are stored; it is older than the other protocols."""
        return STORED_ONE_PASS


PROTOCOL = OnePass
