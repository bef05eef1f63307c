"""Uncertainty of a table's means: intervals over units, and marks of the trackers not worse."""

import numpy as np
from numpy.typing import NDArray

from bench.statistics.rules import MIN_UNITS, interval_or_none, star_marks
from bench.statistics.units import Units
from reports.tables import Measure, Uncertainty


def meaning_of_intervals(units: Units) -> str:
    """Return the sentences of a caption that explain intervals and marks of a table of means."""
    if len(units) < MIN_UNITS:
        plural = units.plural if len(units) != 1 else units.kind
        return (
            f"{len(units)} {plural}: too few for intervals and marks ({MIN_UNITS} needed). "
            "± standard deviation over repetitions."
        )
    return (
        f"[from, to]: 95 % interval of the mean {units.scope}. * or bold: the best mean, and every "
        "tracker that is worse than no other by the interval of their difference, corrected for "
        "all pairs."
    )


def uncertainty_of(values: NDArray[np.float64], measure: Measure) -> Uncertainty:
    """Return the interval of every tracker's mean and which trackers are marked.

    `values`: shape (trackers, units). A tracker with an infinite value has neither.
    """
    if measure.direction is None:
        return Uncertainty([None] * len(values), [False] * len(values))
    finite = np.asarray(np.isfinite(values).all(axis=1))
    intervals = [
        interval_or_none(row, 1, measure.least, measure.most) if known else None
        for row, known in zip(values, finite.tolist(), strict=True)
    ]
    marks = np.zeros(len(values), bool)
    if finite.any():
        marks[finite] = star_marks(
            values[finite],
            measure.margin,
            higher=measure.direction == "higher",
            limit=measure.most - measure.least,
        )
    return Uncertainty(intervals, marks.tolist())
