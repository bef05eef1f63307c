"""What is measured of a run: numbers of series over frames, as a paper's `[measures]` say."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run, Trace
from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.papers.description import Description, Measure
from bench.store.truth import StoredTruth

__all__ = ["Course", "Series", "known_series", "measured", "summarised"]

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """A finished run beside the truth of its sequence (named without variant), frame by frame.

    `allowed` is the share of the mean side up to which an error is `within`; `trace` says which of
    the boxes are meant, and `scores` what is known of them: see `bench.papers.runs.tidy_runs`.
    """

    run: Run
    truth: StoredTruth
    sequence: str
    allowed: float
    trace: Trace = "online"
    scores: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def boxes(self) -> Values:
        """Boxes of the trace, shape (n, 4), in pixels."""
        return self.run.boxes_in(self.trace)

    @cached_property
    def error(self) -> Values:
        """Centre error in pixels, shape (n,); NaN where the target is absent."""
        return centre_error(self.truth.boxes, self.boxes)

    @cached_property
    def overlap(self) -> Values:
        """Overlap in [0, 1], shape (n,); NaN where the target is absent."""
        there = np.isfinite(self.truth.boxes).all(axis=1)
        found = np.full(len(there), nan)
        found[there] = overlap(self.truth.boxes[there], self.boxes[there])
        return found

    @cached_property
    def tolerance(self) -> float:
        """Greatest centre error that is within, in pixels."""
        return float(np.nanmean(self.truth.boxes[:, 2:]) * self.allowed)

    @cached_property
    def within(self) -> Values:
        """1 where the centre is within the tolerance, else 0; NaN where the target is absent."""
        return np.where(np.isnan(self.error), nan, self.error <= self.tolerance)

    def detail(self, name: str) -> Values:
        """A detail of the tracker by frame; NaN where it has none of this name."""
        known = self.run.details.get(name)
        return np.full(len(self.truth.boxes), nan) if known is None else np.asarray(known, float)


Series = Callable[[Course], Values]
"""A number by frame of a run, shape (n,); NaN where there is none."""

_KNOWN: Mapping[str, Series] = {
    "error": lambda course: course.error,
    "within": lambda course: course.within,
    "overlap": lambda course: course.overlap,
    "visible": lambda course: np.asarray(course.truth.visibility, float),
}


def measured(
    course: Course, description: Description, further: Mapping[str, Series]
) -> dict[str, float]:
    """All `[measures]` of a run; `further` are series of the paper's own."""
    known: dict[str, Values] = {}
    found = {}
    for name, measure in description.measures.items():
        if measure.of not in known:
            known[measure.of] = known_series(measure.of, further)(course)
        found[name] = summarised(known[measure.of], measure, description.frames_from)
    return found


def known_series(name: str, further: Mapping[str, Series]) -> Series:
    """A series by its name: the paper's own, one that all have, or a detail of the tracker."""
    return further.get(name) or _KNOWN.get(name) or (lambda course: course.detail(name))


def summarised(series: Values, measure: Measure, frames_from: int = 0) -> float:
    """One number of a series, shape (n,); NaN where nothing is known in the frames that are meant.

    They are those from the measure's first to its last, both included; the first alone where there
    is no last. The first of all is called `frames_from`; negative ones count from the end, -1 being
    the last of all.
    """
    n = len(series)
    first = 0 if measure.first is None else measure.first
    last = measure.last
    if last is None:
        last = -1 if measure.first is None else first
    start = first - frames_from if measure.first is not None and first >= 0 else first % n
    stop = (last % n if last < 0 else last - frames_from) + 1
    values = series[start:stop]
    values = values[~np.isnan(values)]
    return float(_HOW[measure.how](values)) if len(values) else nan


_HOW: Mapping[str, Callable[[Values], float]] = {
    "mean": np.mean,
    "median": np.median,
    "min": np.min,
    "max": np.max,
    "all": np.all,
    "any": np.any,
}
