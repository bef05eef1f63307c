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

    Mean and interval of the answer are positive if the first is better; `interval` is that of the
    differences, whatever the direction of the measure.
    """

    first: str
    second: str
    differences: NDArray[np.float64]  # shape (n_sequences,), in the order of the sequences
    by_unit: NDArray[np.float64]  # shape (n_units,): their means
    answer: Answer  # about the first
    interval: Interval | None  # corrected for all pairs; None for too few units
    wins: int  # units on which the first is better
    same_boxes: int  # sequences on which both gave the same boxes in all runs

    @property
    def difference(self) -> float:
        """Mean over the units."""
        return float(self.by_unit.mean())


def compare_pairs(
    means: Mapping[str, NDArray[np.float64]],
    units: Units,
    measure: Measure,
    margin: float,
    against: str | None,
    same_boxes: Mapping[tuple[str, str], int],
) -> list[Pair]:
    """Compare all pairs, or one tracker with each other one, in the order of the labels.

    `means`: over repetitions, shape (n_sequences,), by tracker. `against`: label of that tracker.
    """
    names = list(combinations(means, 2))
    if against is not None:
        names = [(against, name) for name in means if name != against]
    sign, widest = sign_of(measure), measure.most - measure.least
    pairs = []
    for first, second in names:
        differences = means[first] - means[second]
        by_unit = units.means(differences)
        answer = decide(sign * by_unit, margin, len(names), limit=widest, unit=units.plural)
        interval = answer.interval
        if interval is not None and sign < 0:
            interval = Interval(-interval.high, -interval.low)
        same = same_boxes.get((first, second), same_boxes.get((second, first), 0))
        wins = int((sign * by_unit > 0).sum())
        pairs.append(Pair(first, second, differences, by_unit, answer, interval, wins, same))
    return pairs


def sign_of(measure: Measure) -> float:
    """Return 1 if higher scores are better, -1 if lower ones are."""
    return 1.0 if measure.direction == "higher" else -1.0
