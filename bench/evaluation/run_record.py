"""The record of one run: what determined it, what the tracker said, how it ended."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from numpy.typing import NDArray

from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times

Trace: TypeAlias = Literal["online", "revised"]
"""What a tracker said of each frame at once, or in the end."""

RESERVED_COLUMNS = frozenset(
    ["frame", "x", "y", "width", "height", "visible", "confidence"]
    + ["wall_seconds", "cpu_seconds", "warm_wall_seconds", "warm_cpu_seconds"]
    + ["region_similarity", "contour_accuracy", "state", "segment", "answered"]
)
"""Columns of our own, of which some runs lack some; a tracker's details have other names."""


@dataclass(frozen=True)
class Run:
    """One tracker, one sequence, one repetition.

    It has a row a frame; by a protocol with segments those of the first, then of the second, …

    Attributes
    ----------
    identity : Identity
        What determined it.
    boxes : ndarray of float64, shape (n, 4)
        Online boxes, in pixels. The frame of initialisation holds the given box, frames
        before it and frames after a failure NaN.
    visible : ndarray of bool, shape (n,)
        Whether the tracker said that it sees the target.
    confidence : ndarray of float64, shape (n,)
        In [0, 1], NaN where it gave none.
    details : mapping of str to ndarray of float64, shape (n,)
        The tracker's own numbers, NaN where it gave none.
    failure : str
        Empty for a finished run; else what went wrong (frame, reason and traceback).
    revised : ndarray of float64, shape (n, 4), or None
        Boxes with the tracker's later corrections; None where it made none.
    arrays : mapping of int to mapping of str to ndarray
        By frame, where they were asked for; masks are among them as `mask`, maps (see
        `trackers.Mapper`) as `map.NAME`, of uint8, 255 for 1.
    segmentation : Segmentation or None
        Of a tracker that gave masks, on a sequence that has them; not in timing runs.
    times : Times or None
        In timing runs.
    states : ndarray of int32, shape (n,), or None
        A `bench.metrics.preset.State` a frame, in runs that were begun again after failures.
    answered : ndarray of int32, shape (n,), or None
        Frame whose answer stands in a row, in runs in real time; -1 before the first.
    segments : tuple of ndarray of int32
        Numbers of the frames of each segment; empty for a run over the whole sequence.
    circumstances : mapping of str to value
        What did not determine it: date, host, libraries, where the sequence was opened from, …
    output : str
        The end of what a failed tracker printed.
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
        """How it ended."""
        return "failed" if self.failure else "finished"

    def boxes_in(self, trace: Trace) -> NDArray[Any]:
        """Boxes of a trace, shape (n, 4); both are the same where nothing was corrected."""
        return self.boxes if trace == "online" or self.revised is None else self.revised

    def __repr__(self) -> str:
        key = self.identity
        return f"<Run {key.tracker} on {key.sequence}, repetition {key.repetition}: {self.status}>"
