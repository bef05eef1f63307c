"""What a metrics preset is: definitions of scores that go by one name.

A preset is a file in `bench/metrics/presets`. Its docstring is the definition with its source, and
it exports one `Preset`. It judges one run by its truth, and says what runs on many sequences make
together, which benchmarks do differently.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.metrics.native import Truth

Protocol: TypeAlias = Literal["one pass", "supervised", "anchors"]
"""What a preset takes a run for: once from a box, begun again after failures, from anchors."""


class State(IntEnum):
    """What a frame of a supervised run holds."""

    SKIPPED = 0  # after a failure, before the tracker is initialised again
    INITIALISED = 1
    FAILED = 2
    TRACKED = 3


@dataclass(frozen=True)
class Target:
    """Truth of a sequence as arrays; a `datasets.Sequence` or a stored truth does as well.

    Attributes
    ----------
    boxes : ndarray of float64, shape (n, 4)
        `[x, y, width, height]` in pixels; NaN rows where the target is absent.
    regions : mapping of str to ndarray of float64, shape (n, 4)
        Further truths by name.
    visibility : ndarray of float64, shape (n,)
        Visible fraction; NaN where unknown.
    image_size : tuple of int, or None
        Width and height of the images in pixels, by which some presets cut regions off.
    shapes : sequence of ndarray or None, or None
        By frame the outline that the box bounds, for presets that have overlaps of regions: a
        polygon, float64 of shape (k, 2), or a mask, bool of shape (height, width).
    """

    boxes: NDArray[Any]
    regions: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    visibility: NDArray[Any] = field(default_factory=lambda: np.array(np.nan))
    image_size: tuple[int, int] | None = None
    shapes: Sequence[NDArray[Any] | None] | None = None


@dataclass(frozen=True)
class Answer:
    """What a tracker said of the frames of a run.

    Attributes
    ----------
    boxes : array of float64, shape (n, 4)
        In pixels; rows up to the frame of initialisation are not looked at.
    visible : ndarray of bool, shape (n,), or None
        Whether it said that it sees the target; None where nothing is known.
    confidence : ndarray of float64, shape (n,), or None
        NaN where it gave none.
    states : ndarray of int, shape (n,), or None
        A `State` a frame, in supervised runs.
    of : int
        Frames of the whole sequence, where the run goes over a part of it (from an anchor).
    """

    boxes: ArrayLike
    visible: NDArray[Any] | None = None
    confidence: NDArray[Any] | None = None
    states: NDArray[Any] | None = None
    of: int = 0


@dataclass(frozen=True)
class Judged:
    """What a preset makes of one run, or of many.

    Attributes
    ----------
    scores : mapping of str to float
        By the preset's columns; NaN where one is undefined.
    curves : mapping of str to ndarray of float64, shape (k, 2)
        Points (x, y) by the preset's curves.
    evidence : mapping of str to ndarray
        What the preset needs of this run to judge several together.
    parts : sequence of Judged
        What it was made of, where the run has segments.
    """

    scores: Mapping[str, float]
    curves: Mapping[str, NDArray[Any]]
    evidence: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    parts: Sequence["Judged"] = ()


@dataclass(frozen=True)
class Column:
    """A score: its meaning, a perfect tracker's (None where that depends), which is better.

    `whole`: whether it is defined of all sequences together alone, and of none by itself.
    """

    meaning: str
    perfect: float | None = 1.0
    better: Literal["higher", "lower"] | None = "higher"
    whole: bool = False


_SIGNS = {"auc": "AUC", "eao": "EAO", "ao": "AO", "sr50": "SR 0.50", "sr75": "SR 0.75", "f": "F"}


def heading(score: str) -> str:
    """A score's name as a table has it.

    >>> heading("success_auc")
    'success AUC'
    """
    return " ".join(_SIGNS.get(word, word) for word in score.split("_"))


@dataclass(frozen=True)
class Axes:
    """What a curve shows, and over what."""

    x: str
    y: str


Runs: TypeAlias = Sequence[Sequence[Judged]]
"""Judged runs by sequence: the repetitions, or the runs from its anchors."""


def mean_of_sequences(runs: Runs) -> Judged:
    """Mean over each sequence's runs, then over sequences: each counts once.

    Scores that are undefined (NaN) in a run are left out.
    """
    first = runs[0][0]
    scores = {
        name: _mean([_mean([run.scores[name] for run in of]) for of in runs])
        for name in first.scores
    }
    curves = {
        name: np.mean([np.mean([run.curves[name] for run in of], axis=0) for of in runs], axis=0)
        for name in first.curves
    }
    return Judged(scores, curves)


@dataclass(frozen=True)
class Preset:
    """Definitions of scores that go by one name.

    Attributes
    ----------
    columns : mapping of str to Column
        The scores.
    judge : callable
        `(truth, answer) -> Judged`, a pure function. Raises `ValueError` where there is no truth,
        numbers of rows differ, or the answer lacks what the protocol gives.
    combine : callable
        `(runs) -> Judged`, of one run a sequence at least; see `overall`.
    curves : mapping of str to Axes
        What can be drawn.
    protocol : str
        How runs are made that it can judge.
    agrees : str
        Whose figures these are.
    also : tuple of str
        Further names.
    """

    columns: Mapping[str, Column]
    judge: Callable[[Truth, Answer], Judged]
    combine: Callable[[Runs], Judged] = mean_of_sequences
    curves: Mapping[str, Axes] = field(default_factory=dict)
    protocol: Protocol = "one pass"
    agrees: str = ""
    also: tuple[str, ...] = ()

    def overall(self, runs: Runs) -> Judged:
        """Scores of runs on several sequences together.

        Where a sequence has no run every score is NaN, and there is no curve: what is missing is
        never averaged over. The segments of a run count like runs.
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
    shapes: Sequence[NDArray[Any] | None] | None  # true outlines; see `Target`


def started(truth: Truth, answer: Answer) -> Started:
    """Run and truth from the frame of initialisation on.

    Raises `ValueError` where there is no truth or the numbers of rows differ.
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
    shapes = getattr(truth, "shapes", None)
    return Started(
        frames,
        boxes[frames],
        estimate[frames],
        present[frames],
        getattr(truth, "image_size", None),
        None if shapes is None else shapes[frames],
    )


def alone(combine: Callable[[Runs], Judged], evidence: Mapping[str, NDArray[Any]]) -> Judged:
    """A run judged as if it were all that there is."""
    return replace(combine([[Judged({}, {}, evidence)]]), evidence=evidence)


def _mean(values: list[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")
