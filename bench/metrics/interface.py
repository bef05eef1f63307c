"""Interface of metrics: named sets of definitions of scores.

Each module in `bench/metrics/sets` defines one `Metrics`. The docstring of the module is the
definition with its source. Metrics compute the scores of one run from the ground truth, and combine
the scores of many runs as their benchmark does.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Shapes: TypeAlias = Sequence[NDArray[Any] | None] | None
"""Ground-truth region by frame: a polygon (float64, shape (k, 2)), a mask (bool, shape (height,
width)), or None if the region is the box."""

RunKind: TypeAlias = Literal["one-pass", "supervised", "anchors"]
"""Kind of scored runs: initialised once, restarted after failures, or started from anchors."""


class GroundTruthLike(Protocol):
    """Ground truth of n frames, for example a `datasets.Sequence`."""

    @property
    def boxes(self) -> NDArray[np.float64]:
        """Boxes, shape (n, 4); NaN rows if the target is absent or the frame is not annotated."""
        ...

    @property
    def annotated(self) -> NDArray[np.bool_]:
        """Frames with known box or absence, shape (n,), or () if all; others are not used."""
        ...

    @property
    def malformed(self) -> NDArray[np.bool_]:
        """Frames whose box has no size but is no statement of absence, shape (n,), or () if none.

        Their boxes are NaN. They count as absence, except in toolkits that score them.
        """
        ...

    @property
    def regions(self) -> Mapping[str, NDArray[np.float64]]:
        """Boxes of other regions by name, such as `full`, shape (n, 4)."""
        ...

    @property
    def visibility(self) -> NDArray[np.float64]:
        """Visible fraction, shape (n,); NaN if unknown."""
        ...


class FrameState(IntEnum):
    """State of a frame of a supervised run."""

    SKIPPED = 0  # between a failure and the restart
    INITIALISED = 1
    FAILED = 2
    TRACKED = 3


@dataclass(frozen=True)
class GroundTruthArrays:
    """Ground truth of n frames as arrays, for example of a part of a `datasets.Sequence`."""

    boxes: NDArray[Any]  # (n, 4): `[x, y, width, height]` in pixels; NaN rows without target
    # (n,): frames for which box or absence is known; shape () for all
    annotated: NDArray[np.bool_] = field(default_factory=lambda: np.array(True), kw_only=True)
    # (n,): frames whose box has no size (NaN in `boxes`) but is no absence; shape () for no frame
    malformed: NDArray[np.bool_] = field(default_factory=lambda: np.array(False), kw_only=True)
    # boxes of other regions by name
    regions: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    visibility: NDArray[Any] = field(default_factory=lambda: np.array(np.nan))  # (n,): in [0, 1]
    # width and height of the images, for metrics that clip regions
    image_size: tuple[int, int] | None = None
    shapes: Shapes = None  # polygons or masks, for metrics that use them instead of boxes


@dataclass(frozen=True)
class RunEstimates:
    """Estimates of a tracker in the n frames of a run."""

    boxes: ArrayLike  # (n, 4); rows up to the initialisation are ignored
    visible: NDArray[Any] | None = None  # (n,): True if the target was reported; None if unknown
    confidence: NDArray[Any] | None = None  # (n,): NaN if missing
    states: NDArray[Any] | None = None  # (n,): a `FrameState` per frame of a supervised run
    n_sequence_frames: int = 0  # length of the sequence, if the run covers only a part


@dataclass(frozen=True)
class MetricResult:
    """Scores and curves of one run or of many."""

    scores: Mapping[str, float]  # by metric; NaN if a score is undefined
    curves: Mapping[str, NDArray[Any]]  # points (x, y), shape (k, 2)
    intermediate: Mapping[str, NDArray[Any]] = field(default_factory=dict)  # input of `combine`
    segment_results: Sequence[
        "MetricResult"
    ] = ()  # results of the segments of the run, if it has any


@dataclass(frozen=True)
class Metric:
    """Definition of a number of a run."""

    meaning: str
    best_value: float | None = 1.0  # score of a perfect tracker; None if it depends on the sequence
    direction: Literal["higher", "lower"] | None = "higher"
    only_overall: bool = False  # True if the score exists only for all sequences together


_ABBREVIATIONS = {
    "auc": "AUC",
    "eao": "EAO",
    "ao": "AO",
    "sr50": "SR 0.50",
    "sr75": "SR 0.75",
    "f": "F",
}


def heading(score: str) -> str:
    """Return the column heading of a score.

    >>> heading("success_auc")
    'success AUC'
    """
    return " ".join(_ABBREVIATIONS.get(word, word) for word in score.split("_"))


ResultsBySequence: TypeAlias = Sequence[Sequence[MetricResult]]
"""Results of the runs on each sequence: one per repetition or anchor."""


def mean_of_sequences(runs: ResultsBySequence) -> MetricResult:
    """Average over the runs of each sequence, then over sequences, ignoring NaN scores."""
    scores = {
        name: _mean([_mean([run.scores[name] for run in group]) for group in runs])
        for name in runs[0][0].scores
    }
    curves = {
        name: np.mean(
            [np.mean([run.curves[name] for run in group], axis=0) for group in runs], axis=0
        )
        for name in runs[0][0].curves
    }
    return MetricResult(scores, curves)


@dataclass(frozen=True)
class Metrics:
    """Named set of score definitions.

    `score` is a pure function. It raises `ValueError` if there is no ground truth, the numbers of
    rows differ or the estimates lack data that the protocol provides. `combine` requires at least
    one run per sequence; see `overall`.
    """

    metrics: Mapping[str, Metric]
    score: Callable[[GroundTruthLike, RunEstimates], MetricResult]
    combine: Callable[[ResultsBySequence], MetricResult] = mean_of_sequences
    curves: Mapping[str, tuple[str, str]] = field(default_factory=dict)  # labels of x and y axis
    run_kind: RunKind = "one-pass"
    agrees_with: str = ""  # toolkits that compute equal scores
    undefined: str = ""  # reason for NaN scores of a run, without full stop, for notes
    aliases: tuple[str, ...] = ()

    def overall(self, runs: ResultsBySequence) -> MetricResult:
        """Return the scores over all runs on several sequences.

        If a sequence has no run, every score is NaN and there is no curve: an average never
        conceals missing runs. Each segment of a run counts as a run.
        """
        if not runs or not all(runs):
            return MetricResult(dict.fromkeys(self.metrics, np.nan), {})
        return self.combine(
            [[part for run in group for part in run.segment_results or [run]] for group in runs]
        )


@dataclass(frozen=True)
class EvaluatedRun:
    """Annotated frames of a run and their ground truth from the first frame with a target."""

    frames: NDArray[np.int64]  # (m,): numbers of these frames
    truth: NDArray[np.float64]  # (m, 4)
    estimate: NDArray[np.float64]  # (m, 4); the first box is the ground truth
    present: NDArray[np.bool_]  # (m,): frames with a target
    malformed: NDArray[np.bool_]  # (m,): see `GroundTruthArrays`
    size: tuple[int, int] | None  # width and height of the images; None if unknown
    all_shapes: Shapes  # regions of all frames

    @property
    def shapes(self) -> Iterator[NDArray[Any] | None]:
        """Regions of the selected frames; masks are decoded one by one."""
        frames = () if self.all_shapes is None else self.frames.tolist()
        return (self.all_shapes[frame] for frame in frames if self.all_shapes is not None)


def select_evaluated(truth: GroundTruthLike, estimates: RunEstimates) -> EvaluatedRun:
    """Select the annotated frames of a run and their ground truth from the initialisation on.

    Frames that are not annotated do not count in any metrics: neither as hits nor as misses. Of a
    supervised run, initialisations and failures are facts of the run and are always selected.

    Raises `ValueError` if there is no ground truth or the numbers of rows differ.
    """
    boxes = np.asarray(truth.boxes, np.float64, order="F")  # see `overlap`
    estimate = np.array(estimates.boxes, np.float64, order="F")
    n = len(boxes)
    if estimate.shape != (n, 4):
        raise ValueError(
            f"Estimated boxes have shape {estimate.shape}. Expected: ({n}, 4), as the ground truth."
        )
    annotated = np.broadcast_to(truth.annotated, n)
    present = np.asarray(np.isfinite(boxes).all(axis=1)) & annotated
    first = int(present.argmax()) if n else 0
    if not n or not present[first]:
        raise ValueError("The ground truth has no frame with a target. Expected: at least one.")
    if estimates.states is not None:
        if np.shape(estimates.states) != (n,):
            raise ValueError(
                f"The states of a supervised run have shape {np.shape(estimates.states)}. "
                f"Expected: ({n},), with INITIALISED first."
            )
        facts = (FrameState.INITIALISED, FrameState.FAILED)
        annotated = annotated | np.isin(estimates.states, facts)
    frames = first + np.flatnonzero(annotated[first:])
    estimate[first] = boxes[first]
    shapes, size = getattr(truth, "shapes", None), getattr(truth, "image_size", None)
    malformed = np.broadcast_to(truth.malformed, n)[frames]
    rows = boxes[frames], estimate[frames], present[frames], malformed
    return EvaluatedRun(frames, *rows, size, shapes)


def annotates_init_only(truth: GroundTruthLike) -> bool:
    """Return whether frames are not annotated, and none after the initialisation is annotated.

    This is the ground truth of test sets, whose later boxes are not public.
    """
    n = len(truth.boxes)
    annotated = np.broadcast_to(truth.annotated, n)
    first = int(np.isfinite(truth.boxes).all(axis=1).argmax()) if n else 0
    return not annotated.all() and not annotated[first + 1 :].any()


def single_run_result(
    combine: Callable[[ResultsBySequence], MetricResult], intermediate: Mapping[str, NDArray[Any]]
) -> MetricResult:
    """Return the result for a data set that consists of one run."""
    return replace(combine([[MetricResult({}, {}, intermediate)]]), intermediate=intermediate)


def _mean(values: list[float]) -> float:
    finite = [value for value in values if not np.isnan(value)]
    return float(np.mean(finite)) if finite else np.nan
