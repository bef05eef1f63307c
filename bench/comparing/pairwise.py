"""Pairs of trackers on the same sequences: differences, and the answers of the shared rules."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.statistics.intervals import Interval
from bench.statistics.rules import Answer, decide
from bench.statistics.units import Units
from reports.tables import Measure

__all__ = ["Losses", "Pair", "Scores", "compare_pairs", "sign_of"]

Scores: TypeAlias = Mapping[str, Sequence[NDArray[np.float64]]]
"""Scores of the repetitions, by tracker and sequence."""

Losses: TypeAlias = Mapping[str, Sequence[tuple[NDArray[np.float64], NDArray[np.bool_]]]]
"""When runs were lost or ended [frames], and whether they were lost, by tracker and sequence."""


@dataclass(frozen=True)
class Pair:
    """Two trackers: the first's score minus the second's.

    Attributes
    ----------
    first, second : str
        Labels.
    differences : ndarray of float64, shape (n_sequences,)
        In the order of the sequences.
    by_unit : ndarray of float64, shape (n_units,)
        Their means by unit.
    answer : Answer
        About the first tracker. Mean and interval are positive if it is better, whatever the
        direction of the measure; `interval` below is that of the differences.
    interval : Interval or None
        Corrected interval of the mean difference; None for too few units.
    same_boxes : int
        Sequences on which both gave the same boxes in all runs.
    """

    first: str
    second: str
    differences: NDArray[np.float64]
    by_unit: NDArray[np.float64]
    answer: Answer
    interval: Interval | None
    wins: int  # units on which the first is better
    same_boxes: int = 0

    @property
    def difference(self) -> float:
        """Mean over the units."""
        return float(self.by_unit.mean())


def compare_pairs(
    means: Mapping[str, NDArray[np.float64]],
    units: Units,
    measure: Measure,
    margin: float,
    against: str | None = None,
    same_boxes: Mapping[tuple[str, str], int] | None = None,
) -> list[Pair]:
    """Compare all pairs, or one tracker with each other one, in the order of the labels.

    Parameters
    ----------
    means : mapping of str to ndarray of float64, shape (n_sequences,)
        Mean over repetitions, by tracker.
    units : Units
        Units of the sequences.
    measure : Measure
        Compared score.
    margin : float
        Differences up to this are irrelevant.
    against : str, optional
        Tracker that is compared with each other one.
    same_boxes : mapping of pair to int, optional
        Number of sequences on which two trackers gave the same boxes.
    """
    names = list(combinations(means, 2))
    if against is not None:
        names = [(against, name) for name in means if name != against]
    return [
        _pair(pair, means, units, measure, margin, len(names), same_boxes or {}) for pair in names
    ]


def _pair(
    names: tuple[str, str],
    means: Mapping[str, NDArray[np.float64]],
    units: Units,
    measure: Measure,
    margin: float,
    comparisons: int,
    same_boxes: Mapping[tuple[str, str], int],
) -> Pair:
    first, second = names
    differences = means[first] - means[second]
    by_unit, sign = units.means(differences), sign_of(measure)
    widest = measure.most - measure.least
    answer = decide(sign * by_unit, margin, comparisons, limit=widest, unit=units.plural)
    interval = answer.interval
    if interval is not None and sign < 0:
        interval = Interval(-interval.high, -interval.low)
    same = same_boxes.get(names, same_boxes.get((second, first), 0))
    wins = int((sign * by_unit > 0).sum())
    return Pair(first, second, differences, by_unit, answer, interval, wins, same)


def sign_of(measure: Measure) -> float:
    """Return 1 if higher scores are better, -1 if lower ones are."""
    return 1.0 if measure.direction == "higher" else -1.0
