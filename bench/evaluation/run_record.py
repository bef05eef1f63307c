"""Record of one run: identity, estimates and status."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from numpy.typing import NDArray

from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times

Trace: TypeAlias = Literal["online", "revised"]
"""Estimates of each frame at once, or with the tracker's later corrections."""

RESERVED_COLUMNS = frozenset(
    ["frame", "x", "y", "width", "height", "visible", "confidence"]
    + ["wall_seconds", "cpu_seconds", "warm_wall_seconds", "warm_cpu_seconds"]
    + ["region_similarity", "contour_accuracy", "state", "segment", "answered"]
)
"""Columns of the harness; a tracker's details have other names."""


@dataclass(frozen=True)
class Run:
    """One tracker, one sequence, one repetition.

    It has one row per frame. A protocol with segments has the rows of the first segment, then those
    of the second, and so on.

    Attributes
    ----------
    identity : Identity
        Everything that determined the run.
    boxes : ndarray of float64, shape (n, 4)
        Online boxes [px]. The frame of initialisation holds the init box; frames before it and
        after a failure are NaN.
    visible : ndarray of bool, shape (n,)
        Whether the tracker reported the target as visible.
    confidence : ndarray of float64, shape (n,)
        In [0, 1]; NaN if the tracker gave none.
    details : mapping of str to ndarray of float64, shape (n,)
        The tracker's own numbers; NaN if it gave none.
    failure : str
        Frame, reason and traceback; empty for a finished run.
    revised : ndarray of float64, shape (n, 4), or None
        Boxes with the tracker's later corrections; None if it made none.
    arrays : mapping of int to mapping of str to ndarray
        Requested arrays by frame. Masks are called `mask`; maps (see `trackers.Mapper`) are called
        `map.NAME`, of uint8, 255 for 1.
    segmentation : Segmentation or None
        Agreement of the masks with the ground truth, if both exist; None in timing runs.
    times : Times or None
        Only in timing runs.
    states : ndarray of int32, shape (n,), or None
        `bench.metrics.preset.FrameState` by frame, in runs with restarts after failures.
    answered : ndarray of int32, shape (n,), or None
        Frame whose estimate a row repeats, in real-time runs; -1 before the first.
    segments : tuple of ndarray of int32
        Frame numbers of each segment; empty for a run over the whole sequence.
    circumstances : mapping of str to value
        What did not determine the run: date, host, libraries, source of the sequence, times.
    output : str
        End of what a failed tracker printed.
    """

    identity: Identity
    boxes: NDArray[Any]
    visible: NDArray[Any]
    confidence: NDArray[Any]
    details: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    failure: str = ""
    revised: NDArray[Any] | None = None
    arrays: Mapping[int, Mapping[str, NDArray[Any]]] = field(default_factory=dict)
    segmentation: Segmentation | None = None
    times: Times | None = None
    states: NDArray[Any] | None = None
    answered: NDArray[Any] | None = None
    segments: tuple[NDArray[Any], ...] = ()
    circumstances: Mapping[str, Any] = field(default_factory=dict)
    output: str = ""

    @property
    def status(self) -> Literal["finished", "failed"]:
        """`failed` if there is a failure."""
        return "failed" if self.failure else "finished"

    def boxes_in(self, trace: Trace) -> NDArray[Any]:
        """Return the boxes of a trace, shape (n, 4); without corrections both are equal."""
        return self.boxes if trace == "online" or self.revised is None else self.revised

    def __repr__(self) -> str:
        key = self.identity
        return f"<Run {key.tracker} on {key.sequence}, repetition {key.repetition}: {self.status}>"
