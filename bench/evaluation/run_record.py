"""Record of one run: identity, estimates and status."""

import platform
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.metrics.times import Times
from trackmark.datasets import Sequence
from trackmark.datasets.source_digest import library_versions

if TYPE_CHECKING:
    from trackmark.bench.metrics.regions import Segmentation

Trajectory: TypeAlias = Literal["online", "revised"]
"""Trajectory of a run: boxes as returned by each update, or with later corrections."""

RESERVED_COLUMNS = frozenset(
    ["frame", "x", "y", "width", "height", "visible", "confidence"]
    + ["region_similarity", "contour_accuracy", "state", "segment", "estimate_frame"]
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
        Requested arrays by frame. Masks are called `mask`; maps (see `trackers.WeightMapTracker`)
        are called `map.NAME`, of uint8, 255 for 1.
    segmentation : Segmentation or None
        Agreement of masks with the ground truth; None without masks, and in timing runs.
    times : Times or None
        Times of a timing run; None for other runs.
    states : ndarray of int32, shape (n,), or None
        `bench.metrics.interface.FrameState` by frame, in runs with restarts after failures.
    estimate_frames : ndarray of int32, shape (n,), or None
        Frame of the estimate in each row of a real-time run; -1 before the first estimate.
    segments : tuple of ndarray of int32
        Frame numbers of each segment; empty for a protocol without segments.
    metadata : mapping of str to value
        Other properties, such as date, host, libraries, source of the sequence and times.
        `generators` lists the global random generators from which the tracker has drawn.
    tracker_output : str
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
    segmentation: "Segmentation | None" = None
    times: Times | None = None
    states: NDArray[Any] | None = None
    estimate_frames: NDArray[Any] | None = None
    segments: tuple[NDArray[Any], ...] = ()
    metadata: Mapping[str, Any] = field(default_factory=dict)
    tracker_output: str = ""

    @property
    def status(self) -> Literal["finished", "failed"]:
        """`failed` if there is a failure, otherwise `finished`."""
        return "failed" if self.failure else "finished"

    def boxes_in(self, trajectory: Trajectory) -> NDArray[Any]:
        """Return the online or revised boxes, shape (n, 4), which are equal without corrections."""
        return self.boxes if trajectory == "online" or self.revised is None else self.revised

    def overlaps(self, sequence: str | Path | Sequence | None = None) -> NDArray[np.float64]:
        """Return the overlap (IoU) of each row with the ground truth, shape (n,).

        Values are in [0, 1]. They are NaN if the target is absent or the frame is not annotated, 0
        for rows without a box, and 1 for the init box. By default the sequence is opened as for the
        run. Raises `ValueError` for another sequence.
        """
        return overlap(self._truth(sequence), self.boxes)

    def centre_errors(self, sequence: str | Path | Sequence | None = None) -> NDArray[np.float64]:
        """Return the centre location error of each row [px], shape (n,).

        Values are NaN if the target is absent or the frame is not annotated, and infinite for rows
        without a box. The argument and errors are those of `overlaps`.
        """
        return centre_error(self._truth(sequence), self.boxes)

    def _truth(self, sequence: str | Path | Sequence | None) -> NDArray[np.float64]:
        """Return the ground-truth box of each row, shape (n, 4)."""
        if sequence is None:
            sequence = self.open_sequence()
        loaded: Sequence = opened(sequence)
        if loaded.fingerprint != self.identity.fingerprint:
            raise ValueError(
                f"{self!r} was made on another sequence, or on another version of {loaded.name}."
            )
        boxes = select_ground_truth(loaded, self.identity.init, loaded.name).boxes
        return np.asarray(boxes[np.concatenate(self.segments)] if self.segments else boxes)

    def _repr_html_(self) -> str:
        """Return status, two scores and four frames with the boxes, for a notebook."""
        from trackmark.datasets.film_strip import film_strip  # imported here: it loads OpenCV

        html = f"<p>{escape(repr(self)[1:-1])}</p>"
        if self.failure:
            html += f"<p>{escape(self.failure.splitlines()[0])}</p>"
        try:
            sequence = self.open_sequence()
            truth = self._truth(sequence)
        except ValueError:  # the sequence cannot be opened, or has changed
            return f"{html}<p>The images cannot be opened.</p>"
        first, n = sequence.first_frame, len(self.boxes)
        frames = np.concatenate(self.segments) if self.segments else np.arange(n)
        if not self.failure and not self.segments and self.states is None:
            later = np.isfinite(truth).all(axis=1) & (frames != first)
            scores = self.overlaps(sequence)[later], self.centre_errors(sequence)[later]
            means = [values.mean() if len(values) else np.nan for values in scores]
            html += f"<p>mean overlap {means[0]:.3f}, centre error {means[1]:.2f} px</p>"
        rows = sorted({int(row) for row in np.linspace(min(first, n - 1), n - 1, 4)})
        strip = film_strip(
            [sequence[int(frames[row])] for row in rows],
            [[truth[row], self.boxes[row]] for row in rows],
        )
        return f"{html}{strip}<p>Green: ground truth. Red: estimate.</p>"

    def open_sequence(self) -> Sequence:
        """Return the sequence of the run; raise `SequenceError` if it cannot be opened."""
        # The process of a command scores runs by stored ground truths and opens no sequence.
        from trackmark.bench.evaluation.sequence_cache import evaluated_sequences, load_sequence

        if sequence := evaluated_sequences.get(self.identity.fingerprint):
            return sequence
        name = self.metadata.get("source") or self.identity.sequence
        return load_sequence(name, self.metadata.get("truth") or None)

    def __repr__(self) -> str:
        key = self.identity
        return f"<Run {key.tracker} on {key.sequence}, repetition {key.repetition}: {self.status}>"


def opened(sequence: Any) -> Any:
    """Return a sequence, or its ground truth; a name or path is opened."""
    if not isinstance(sequence, str | Path):
        return sequence
    from trackmark.bench.evaluation.sequence_cache import load_sequence

    return load_sequence(sequence)


def drawing_note(tracker: str, generators: str) -> str:
    """Return the sentence that a tracker is stochastic, although it does not declare it."""
    return (
        f"{tracker} draws from global random generators ({generators}), so it counts as "
        "stochastic. They are seeded for each run."
    )


def with_metadata(run: Run) -> Run:
    """Return the run with date, machine and libraries, unless it has them already.

    In its texts, escapes replace surrogates, which UTF-8 cannot encode.
    """
    metadata = {
        "date": datetime.now(UTC).isoformat(timespec="microseconds"),
        "host": socket.gethostname(),
        "platform": platform.platform(),
        "python": platform.python_version(),
        "libraries": _libraries(),
        **run.metadata,
    }
    failure = run.failure.encode("utf-8", "backslashreplace").decode("utf-8")
    output = run.tracker_output.encode("utf-8", "backslashreplace").decode("utf-8")
    return replace(run, metadata=metadata, failure=failure, tracker_output=output)


@cache
def _libraries() -> dict[str, str]:
    """Return the versions of the libraries that can influence pixels and boxes, by their name."""
    return library_versions({"av", "cv2", "numba", "numpy", "scipy"})
