"""Record of one run: identity, estimates and status."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from numpy.typing import NDArray

from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times

Trace: TypeAlias = Literal["online", "revised"]
"""Kind of boxes: as returned by each update, or with the tracker's later corrections."""

RESERVED_COLUMNS = frozenset(
    ["frame", "x", "y", "width", "height", "visible", "confidence"]
    + ["wall_seconds", "cpu_seconds", "warm_wall_seconds", "warm_cpu_seconds"]
    + ["region_similarity", "contour_accuracy", "state", "segment", "answered"]
)
"""Column names of the harness, which trackers cannot use as names of details."""


@dataclass(frozen=True)
class Run:
    """Run of one tracker on one sequence, in one repetition.

    A run has one row per frame. With a protocol that has segments, rows are ordered by segment.

    Attributes
    ----------
    identity : Identity
        Properties that determine the run.
    boxes : ndarray of float64, shape (n, 4)
        Online boxes [px]. The frame of initialisation holds the init box; frames before it and
        after a failure are NaN.
    visible : ndarray of bool, shape (n,)
        True if the tracker reported the target as visible.
    confidence : ndarray of float64, shape (n,)
        Confidence in [0, 1]; NaN if the tracker returned none.
    details : mapping of str to ndarray of float64, shape (n,)
        Details of the estimates; NaN if the tracker returned none.
    failure : str
        Frame, reason and traceback of a failure; empty for a finished run.
    revised : ndarray of float64, shape (n, 4), or None
        Boxes with the tracker's later corrections; None if there are no corrections.
    arrays : mapping of int to mapping of str to ndarray
        Requested arrays by frame. Masks are called `mask`; maps (see `trackers.Mapper`) are called
        `map.NAME`, of uint8, 255 for 1.
    segmentation : Segmentation or None
        Agreement of masks with the ground truth; None without masks, and in timing runs.
    times : Times or None
        Times of a timing run; None for other runs.
    states : ndarray of int32, shape (n,), or None
        `bench.metrics.preset.FrameState` by frame, in runs with restarts after failures.
    source_frames : ndarray of int32, shape (n,), or None
        Frame of the estimate in each row of a real-time run; -1 before the first estimate.
    segments : tuple of ndarray of int32
        Frame numbers of each segment; empty for a protocol without segments.
    circumstances : mapping of str to value
        Other properties, such as date, host, libraries, source of the sequence and times.
    output : str
        Last part of the output of a failed tracker.
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
    source_frames: NDArray[Any] | None = None
    segments: tuple[NDArray[Any], ...] = ()
    circumstances: Mapping[str, Any] = field(default_factory=dict)
    output: str = ""

    @property
    def status(self) -> Literal["finished", "failed"]:
        """`failed` if there is a failure, otherwise `finished`."""
        return "failed" if self.failure else "finished"

    def boxes_in(self, trace: Trace) -> NDArray[Any]:
        """Return the online or revised boxes, shape (n, 4), which are equal without corrections."""
        return self.boxes if trace == "online" or self.revised is None else self.revised

    def __repr__(self) -> str:
        key = self.identity
        return f"<Run {key.tracker} on {key.sequence}, repetition {key.repetition}: {self.status}>"
