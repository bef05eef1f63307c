"""One pass over the sequence without restarts (OPE).

The tracker is initialised with the ground truth of the first frame in which the target is present,
and updated in every later frame. The tracker is never corrected. This is the default protocol.
Source: Wu, Lim and Yang, "Online object tracking: a benchmark", CVPR 2013.
"""

from typing import ClassVar

from trackmark.bench.protocols import EvaluationProtocol


class OnePass(EvaluationProtocol):
    """Protocol without parameters."""

    run_kinds: ClassVar[tuple[str, ...]] = ("one-pass", "supervised", "anchors")


PROTOCOL = OnePass
