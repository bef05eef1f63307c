"""Once over the sequence: one-pass evaluation (OPE).

The tracker is given the truth of the first frame in which the target is present, and is asked in
every later one; nothing helps it after that. It is what trackers are run by unless told otherwise.
Wu, Lim and Yang, "Online object tracking: a benchmark", CVPR 2013.
"""

from typing import ClassVar

from trackmark.bench.protocols import STORED_ONE_PASS, Protocol


class OnePass(Protocol):
    """Protocol without knobs."""

    judged: ClassVar[tuple[str, ...]] = ("one pass", "supervised", "anchors")

    @property
    def text(self) -> str:
        """Name under which its runs were stored before there were other protocols."""
        return STORED_ONE_PASS


PROTOCOL = OnePass
