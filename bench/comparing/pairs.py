"""Two trackers on the same sequences: what is answered, and by which test."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import nan
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.reporting.doubt import Answer, answer_of
from bench.statistics.intervals import Interval, mean_interval
from bench.statistics.paired import (
    cells_mean,
    cells_needed,
    holm,
    probability_better,
    signed_rank,
)
from bench.statistics.survival import log_rank
from reports.tables import Measure

__all__ = ["Answer", "Losses", "Pair", "Question", "Scores", "paired", "sign_of"]

Question = Literal["new sequences", "new seeds"]
"""What intervals tell of: new sequences like these, or these sequences with new seeds."""

Scores: TypeAlias = Mapping[str, Sequence[NDArray[np.float64]]]
"""Of the repetitions, by tracker and sequence."""

Losses: TypeAlias = Mapping[str, Sequence[tuple[NDArray[np.float64], NDArray[np.bool_]]]]
"""When runs were lost or ended [frames], and whether they were lost, by tracker and sequence."""


@dataclass(frozen=True)
class Pair:
    """Two trackers: the first's score minus the second's, by sequence and in all."""

    first: str
    second: str
    differences: NDArray[np.float64]  # (n,), in the order of the sequences
    interval: Interval | None
    probability: float  # that the first is better on a new sequence
    probability_interval: Interval
    p: float  # of the exact signed-rank test, or of Welch's t over seeds
    adjusted: float  # by Holm, over all pairs
    answer: Answer  # of the first tracker
    needed: float  # sequences, or repetitions, that would settle it; NaN where it is settled
    loss_p: float  # that times to failure are alike: stratified log-rank test
    by_chance: bool  # whether chance has a part in it, without which p tells nothing

    @property
    def difference(self) -> float:
        """Mean over the sequences."""
        return float(self.differences.mean())

    def swapped(self) -> "Pair":
        """The same, told of the second tracker."""
        low, high = self.probability_interval
        answers: dict[Answer, Answer] = {"better": "worse", "worse": "better"}
        return replace(
            self,
            first=self.second,
            second=self.first,
            differences=-self.differences,
            interval=self.interval and Interval(-self.interval.high, -self.interval.low),
            probability=1 - self.probability,
            probability_interval=Interval(1 - high, 1 - low),
            answer=answers.get(self.answer, self.answer),
        )


def paired(
    values: Scores,
    losses: Losses,
    measure: Measure,
    margin: float,
    question: Question,
) -> list[Pair]:
    """All pairs of trackers, in order, with Holm's correction over them; see `compare`."""
    names = list(combinations(values, 2))
    means = {name: np.array([run.mean() for run in found]) for name, found in values.items()}
    repeated = any(len(run) > 1 for found in values.values() for run in found)
    tested: list[tuple[Interval | None, float]] = []
    for first, second in names:
        if question == "new sequences":
            differences = means[first] - means[second]
            tested.append((mean_interval(differences), signed_rank(differences)))
        elif repeated:
            found = cells_mean(values[first], values[second])
            tested.append((found.interval, found.p))
        else:
            tested.append((None, 1.0))
    adjusted = holm([p for _, p in tested])
    sign, widest = sign_of(measure), measure.most - measure.least
    made = []
    for (first, second), (interval, p), level in zip(names, tested, adjusted.tolist(), strict=True):
        differences = means[first] - means[second]
        answer = answer_of(interval, level, margin, measure.direction)
        needed = nan
        if answer == "cannot tell":
            spread = float(differences.std(ddof=1))
            needed = cells_needed(float(differences.mean()), spread, margin, len(names))
            needed = max(needed, len(differences) + 1.0)  # these did not
            if question == "new seeds":
                needed = _seeds_needed(values[first], values[second], margin, len(names))
        share, around = probability_better(sign * differences)
        strata = [(*a, *b) for a, b in zip(losses[first], losses[second], strict=True)]
        _, loss_p = log_rank(strata)
        made.append(
            Pair(
                first,
                second,
                differences,
                interval and interval.within(-widest, widest),
                share,
                around,
                p,
                level,
                answer,
                needed,
                loss_p,
                question == "new sequences" or bool(interval and interval.low < interval.high),
            )
        )
    return made


def _seeds_needed(
    first: Sequence[NDArray[np.float64]],
    second: Sequence[NDArray[np.float64]],
    margin: float,
    tests: int,
) -> float:
    """Repetitions of each that would settle a pair on these sequences; NaN where nothing varies."""
    drawn = [run for run in (*first, *second) if len(run) > 1]
    if not drawn:
        return nan
    # Of the mean of one repetition on every sequence.
    spread = float(np.sqrt(sum(run.var(ddof=1) for run in drawn))) / len(first)
    difference = cells_mean(first, second).mean
    present = max(len(run) for run in drawn)
    return max(cells_needed(difference, spread, margin, tests), present + 1.0)


def sign_of(measure: Measure) -> float:
    """1 where more is better, -1 where less is."""
    return 1.0 if measure.direction == "higher" else -1.0
