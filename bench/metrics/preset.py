"""Metrics preset: definitions of scores that have one name.

A preset is a file in `bench/metrics/presets`. Its docstring is the definition with its source, and
it exports one `Preset`. A preset judges one run by the ground truth, and combines runs on many
sequences, which benchmarks do differently.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.region_overlap import Shapes

Protocol: TypeAlias = Literal["one pass", "supervised", "anchors"]
"""Runs that a preset judges: initialised once, restarted after failures, or from anchors."""


class State(IntEnum):
    """State of a frame of a supervised run."""

    SKIPPED = 0  # after a failure, before the tracker is initialised again
    INITIALISED = 1
    FAILED = 2
    TRACKED = 3


@dataclass(frozen=True)
class Target:
    """Ground truth of n frames as arrays, for example of a part of a `datasets.Sequence`."""

    boxes: NDArray[Any]  # (n, 4): `[x, y, width, height]` in pixels; NaN rows without target
    regions: Mapping[str, NDArray[Any]] = field(default_factory=dict)  # further boxes by name
    visibility: NDArray[Any] = field(default_factory=lambda: np.array(np.nan))  # (n,): in [0, 1]
    image_size: tuple[int, int] | None = None  # width and height, at which some presets cut regions
    shapes: Shapes = None  # for presets that have overlaps of regions


@dataclass(frozen=True)
class Answer:
    """Estimates of a tracker for the n frames of a run."""

    boxes: ArrayLike  # (n, 4); rows up to the frame of initialisation do not matter
    visible: NDArray[Any] | None = None  # (n,): whether the target was reported; None if unknown
    confidence: NDArray[Any] | None = None  # (n,): NaN if there is none
    states: NDArray[Any] | None = None  # (n,): a `State` per frame of a supervised run
    of: int = 0  # frames of the whole sequence, if the run covers a part of it


@dataclass(frozen=True)
class Judged:
    """Result of a preset for one run, or for many."""

    scores: Mapping[str, float]  # by column; NaN if a score is undefined
    curves: Mapping[str, NDArray[Any]]  # points (x, y), shape (k, 2)
    evidence: Mapping[str, NDArray[Any]] = field(default_factory=dict)  # input of `combine`
    parts: Sequence["Judged"] = ()  # results of the segments, if the run has any


@dataclass(frozen=True)
class Column:
    """Score of a preset."""

    meaning: str
    perfect: float | None = 1.0  # of a perfect tracker; None if that depends on the sequence
    better: Literal["higher", "lower"] | None = "higher"
    whole: bool = False  # True if only all sequences together have this score


_SIGNS = {"auc": "AUC", "eao": "EAO", "ao": "AO", "sr50": "SR 0.50", "sr75": "SR 0.75", "f": "F"}


def heading(score: str) -> str:
    """Return the name of a score for the head of a table.

    >>> heading("success_auc")
    'success AUC'
    """
    return " ".join(_SIGNS.get(word, word) for word in score.split("_"))


@dataclass(frozen=True)
class Axes:
    """Labels of the axes of a curve."""

    x: str
    y: str


Runs: TypeAlias = Sequence[Sequence[Judged]]
"""Judged runs by sequence: the repetitions, or the runs from its anchors."""


def mean_of_sequences(runs: Runs) -> Judged:
    """Return the mean over each sequence's runs, then over sequences: each counts once.

    Scores that are undefined (NaN) in a run are left out.
    """
    scores = {
        name: _mean([_mean([run.scores[name] for run in of]) for of in runs])
        for name in runs[0][0].scores
    }
    curves = {
        name: np.mean([np.mean([run.curves[name] for run in of], axis=0) for of in runs], axis=0)
        for name in runs[0][0].curves
    }
    return Judged(scores, curves)


@dataclass(frozen=True)
class Preset:
    """Definitions of scores that have one name.

    `judge` is a pure function. It raises `ValueError` if there is no ground truth, numbers of rows
    differ, or the answer lacks what the protocol provides. `combine` takes at least one run per
    sequence; see `overall`.
    """

    columns: Mapping[str, Column]
    judge: Callable[[Truth, Answer], Judged]
    combine: Callable[[Runs], Judged] = mean_of_sequences
    curves: Mapping[str, Axes] = field(default_factory=dict)
    protocol: Protocol = "one pass"
    agrees: str = ""  # toolkits that compute equal scores
    also: tuple[str, ...] = ()  # aliases

    def overall(self, runs: Runs) -> Judged:
        """Return the scores of runs on several sequences together.

        If a sequence has no run every score is NaN, and there is no curve: missing runs are never
        averaged over. The segments of a run count like runs.
        """
        if not runs or not all(runs):
            return Judged(dict.fromkeys(self.columns, np.nan), {})
        return self.combine([[part for run in of for part in run.parts or [run]] for of in runs])


@dataclass(frozen=True)
class Started:
    """A run and its ground truth from the first frame on in which the target is present."""

    frames: slice
    truth: NDArray[np.float64]  # (m, 4)
    estimate: NDArray[np.float64]  # (m, 4); the first box is that of the ground truth
    present: NDArray[np.bool_]  # (m,): frames with a target
    size: tuple[int, int] | None  # width and height of the images, if the ground truth has them
    shapes: Shapes


def started(truth: Truth, answer: Answer) -> Started:
    """Return run and ground truth from the frame of initialisation on.

    Raises `ValueError` if there is no ground truth or the numbers of rows differ.
    """
    boxes = np.asarray(truth.boxes, np.float64, order="F")  # see `overlap`
    estimate = np.array(answer.boxes, np.float64, order="F")
    n = len(boxes)
    if estimate.shape != (n, 4):
        raise ValueError(f"the boxes have shape {estimate.shape}, the truth ({n}, 4).")
    present = np.asarray(np.isfinite(boxes).all(axis=1))
    first = int(present.argmax()) if n else 0
    if not n or not present[first]:
        raise ValueError("there is no truth to score against.")
    frames = slice(first, n)
    estimate[first] = boxes[first]
    shapes, size = getattr(truth, "shapes", None), getattr(truth, "image_size", None)
    shapes = None if shapes is None else shapes[frames]
    return Started(frames, boxes[frames], estimate[frames], present[frames], size, shapes)


def alone(combine: Callable[[Runs], Judged], evidence: Mapping[str, NDArray[Any]]) -> Judged:
    """Return the result for a run that is the only one of a data set."""
    return replace(combine([[Judged({}, {}, evidence)]]), evidence=evidence)


def _mean(values: list[float]) -> float:
    finite = [value for value in values if not np.isnan(value)]
    return float(np.mean(finite)) if finite else np.nan
