"""From stored runs to answers: which tracker is better, by how much, and how surely.

A tracker's repetitions on a sequence are averaged first, then the sequences of a unit. Trackers are
paired by sequence, never by seed: the same seed means nothing to two methods.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, nan
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.comparing.comparable_runs import AllFailedError, check_runs, chosen_trackers
from bench.comparing.pairwise import Losses, Pair, Scores, compare_pairs, sign_of
from bench.protocols import STORED_ONCE, TIMING
from bench.reporting.failed_runs import failed_runs
from bench.reporting.tables import own_times
from bench.statistics.intervals import Interval
from bench.statistics.rules import interval_or_none, star_marks
from bench.statistics.units import Units, units_of
from reports.tables import Measure
from reports.times import timed_by

__all__ = ["Comparison", "Standing", "compare", "means_in_part", "parts_of"]

DEFAULT = "default"
"""Stands for the value of a parameter that a sequence's name does not set."""


@dataclass(frozen=True)
class Standing:
    """A tracker in a comparison; means are in the measure's unit before scaling."""

    tracker: str
    mean: float
    interval: Interval | None  # of the mean at 95 %; None for too few units
    contender: bool  # whether the star marks it
    kept: float  # share of runs that never lost the target
    milliseconds: float  # per frame
    timed: bool  # by timing runs; else by the accuracy runs, which share the machine


@dataclass(frozen=True)
class Comparison:
    """Trackers compared by one measure; `scores` are by tracker, sequence and repetition."""

    measure: Measure
    margin: float
    units: Units
    sequences: Sequence[str]
    scores: Scores
    losses: Losses
    standings: Sequence[Standing]
    pairs: Sequence[Pair]
    against: str | None = None  # tracker that all pairs begin with; None for all pairs
    failures: Mapping[str, str] = field(default_factory=dict)  # how many runs failed, and why
    left_out: Collection[str] = ()  # trackers whose every run failed
    not_repeatable: Collection[str] = ()  # trackers that gave other boxes with the same seed
    attributes: Sequence[Collection[str]] = ()  # that occur in each sequence, where it is known

    @cached_property
    def best(self) -> Standing:
        """The tracker with the best mean."""
        sign = sign_of(self.measure)
        return max(self.standings, key=lambda standing: sign * standing.mean)

    @property
    def main_pairs(self) -> list[Pair]:
        """Pairs with the tracker that others are compared with: `against`, or the best one."""
        main = self.against or self.best.tracker
        return [pair for pair in self.pairs if main in (pair.first, pair.second)]

    @cached_property
    def repetitions(self) -> tuple[int, int]:
        """Fewest and most of any tracker on any sequence."""
        counts = [len(runs) for by_sequence in self.scores.values() for runs in by_sequence]
        return min(counts), max(counts)

    def most_different(self, count: int) -> dict[str, tuple[str, str]]:
        """So many sequences on which two trackers that were run differ most, and these two."""
        ran = {name for name, runs in self.losses.items() if any(len(ends) for ends, _ in runs)}
        differences = {
            (abs(float(difference)), sequence): (pair.first, pair.second)
            for pair in self.pairs
            if ran >= {pair.first, pair.second}
            for sequence, difference in zip(self.sequences, pair.differences, strict=True)
        }
        chosen: dict[str, tuple[str, str]] = {}
        for (_, sequence), trackers in sorted(differences.items(), reverse=True):
            if len(chosen) < count:
                chosen.setdefault(sequence, trackers)
        return chosen

    def by_part(self, pair: Pair) -> dict[tuple[str, str], tuple[int, NDArray[np.float64]]]:
        """Number of sequences in parts of them, and a pair's differences by unit of each part.

        Parts are values of parameters that the sequences' names set (`:light=dappled`), except for
        their scene, if they take several values (`DEFAULT` if a name sets none); and attributes
        that some sequences have and some have not.
        """
        return {
            key: (int(chosen.sum()), means_in_part(self.units, pair.differences, chosen))
            for key, chosen in parts_of(self.sequences, self.attributes).items()
        }


def parts_of(
    sequences: Sequence[str], attributes: Sequence[Collection[str]] = ()
) -> dict[tuple[str, str], NDArray[np.bool_]]:
    """Which of n sequences are of a part, (n,), by knob and value, or attribute and its name.

    `attributes`: that occur in each sequence, where it is known. See `Comparison.by_part`.
    """
    rows = [
        dict(part.split("=", 1) for part in name.split(":")[1:] if "=" in part)
        for name in sequences
    ]
    knobs = sorted({knob for row in rows for knob in row} - {"scene"})
    scenes = [name.partition(":")[0] for name in sequences]
    for knob in knobs:  # a canonical name does not say what is as it always is
        turned = {scene for scene, row in zip(scenes, rows, strict=True) if knob in row}
        for scene, row in zip(scenes, rows, strict=True):
            if scene in turned:
                row.setdefault(knob, DEFAULT)
    found = {
        (knob, value): np.array([row.get(knob) == value for row in rows])
        for knob in knobs
        for value in sorted({row[knob] for row in rows if knob in row}, key=_in_order)
    }
    several = {knob for knob in knobs if sum(name == knob for name, _ in found) > 1}
    parts = {key: chosen for key, chosen in found.items() if key[0] in several}
    for name in sorted({name for names in attributes for name in names}):
        having = np.array([name in names for names in attributes])
        if not having.all():
            parts["attribute", name] = having
    return parts


def means_in_part(
    units: Units, by_sequence: NDArray[np.float64], chosen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return means of the units that have chosen sequences, over these.

    `by_sequence`, `chosen`: shape (n_sequences,).
    """
    members = [member[chosen[member]] for member in units.members]
    return np.array([by_sequence[member].mean() for member in members if len(member)])


def _in_order(value: str) -> tuple[bool, float, str]:
    """Values of a knob: the one that is not said first, then numbers by their size."""
    try:
        number = float(value)
    except ValueError:
        number = inf
    return value != DEFAULT, number, value


def compare(
    runs: pd.DataFrame,
    measure: Measure,
    margin: float,
    trackers: Sequence[str] | None = None,
    against: str | None = None,
    *,
    by_scene: bool = False,
    attributes: Mapping[str, Collection[str]] | None = None,
    same_boxes: Mapping[tuple[str, str], int] | None = None,
    not_repeatable: Collection[str] = (),
) -> Comparison:
    """Compare trackers on the sequences that all of them ran on.

    `runs`: as `load_results` gives them, of one experiment, failed ones with the worst scores.
    `measure`: a column of theirs with a direction; `margin`: in its unit. `trackers`: labels, all
    stored ones by default. `against`: tracker that is compared with each other one. `by_scene`:
    scenes of several families are the units. `attributes`: that occur, by sequence.
    `same_boxes`: on how many sequences two trackers gave the same ones. `not_repeatable`: trackers
    that gave other boxes with the same seed.

    Raises `ComparisonError` for runs that cannot be compared, `AllFailedError` if all failed.
    """
    scored = runs[runs["protocol"] == STORED_ONCE]
    chosen = chosen_trackers(scored, trackers, against)
    scored = scored[scored["tracker"].isin(chosen)]
    failures = failed_runs(scored, "0" if measure.direction == "higher" else "the worst score")
    scored = scored[~scored["tracker"].isin(failures.left_out)]
    chosen = [name for name in chosen if name not in failures.left_out]
    if not chosen:
        raise AllFailedError("; ".join(f"{name}: {note}" for name, note in failures.notes.items()))
    sequences = [str(name) for name in scored["sequence"].unique()]
    check_runs(scored, chosen, sequences, measure)
    by_tracker = _cells(scored, chosen, sequences)
    values = {
        name: [of[measure.name].to_numpy(np.float64) for of in by_sequence]
        for name, by_sequence in by_tracker.items()
    }
    losses = {name: list(map(_losses, by_sequence)) for name, by_sequence in by_tracker.items()}
    units = units_of(sequences, "scene" if by_scene else None)
    means = {name: np.array([run.mean() for run in of]) for name, of in values.items()}
    against = None if against in failures.left_out else against
    return Comparison(
        measure=measure,
        margin=margin,
        units=units,
        sequences=sequences,
        scores=values,
        losses=losses,
        standings=_standings(runs, means, losses, units, measure, margin),
        pairs=compare_pairs(means, units, measure, margin, against, same_boxes or {}),
        against=against,
        failures=failures.notes,
        left_out=failures.left_out,
        not_repeatable=[name for name in chosen if name in not_repeatable],
        attributes=[attributes.get(name, ()) for name in sequences] if attributes else [],
    )


def _cells(
    scored: pd.DataFrame, chosen: Sequence[str], sequences: Sequence[str]
) -> dict[str, list[pd.DataFrame]]:
    """Return the repetitions, by tracker and sequence."""
    grouped = scored.groupby(["tracker", "sequence"], observed=True, sort=False)
    cells: dict[Any, pd.DataFrame] = dict(iter(grouped))
    return {name: [cells[name, sequence] for sequence in sequences] for name in chosen}


def _standings(
    runs: pd.DataFrame,
    means: Mapping[str, NDArray[np.float64]],
    losses: Losses,
    units: Units,
    measure: Measure,
    margin: float,
) -> list[Standing]:
    clock = timed_by(runs[(runs["protocol"] == TIMING) & runs["tracker"].isin(list(means))])
    by_unit = {name: units.means(values) for name, values in means.items()}
    marks = star_marks(
        np.array(list(by_unit.values())),
        margin,
        higher=measure.direction == "higher",
        limit=measure.most - measure.least,
    )
    standings = []
    for (name, values), mark in zip(by_unit.items(), marks, strict=True):
        milliseconds, timed = _times(runs[runs["tracker"] == name], clock)
        lost = np.concatenate([failed for _, failed in losses[name]])
        kept = float(1 - lost.mean()) if len(lost) else nan
        interval = interval_or_none(values, 1, measure.least, measure.most)
        mean = float(values.mean())
        standings.append(Standing(name, mean, interval, mark, kept, milliseconds, timed))
    return standings


def _losses(runs: pd.DataFrame) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """When runs were lost or ended [frames], and whether they were lost."""
    if "first_loss" not in runs or "frames" not in runs:
        return np.empty(0), np.empty(0, bool)
    first, frames = (runs[name].to_numpy(np.float64) for name in ("first_loss", "frames"))
    known = np.isfinite(first) & np.isfinite(frames)
    return np.minimum(first, frames)[known], (first < frames)[known]


def _times(runs: pd.DataFrame, clock: str) -> tuple[float, bool]:
    """Milliseconds a frame, and whether timing runs say so, by these columns."""
    if clock:
        timed = runs[(runs["protocol"] == "timing") & runs[f"{clock}_median"].notna()]
        if len(timed):
            by_sequence = timed.groupby("sequence", observed=True)[f"{clock}_median"].mean()
            return 1e3 * float(by_sequence.mean()), True
    scored = runs[(runs["protocol"] == "accuracy") & runs["seconds"].notna()]
    return 1e3 * float(own_times(scored).mean()) if len(scored) else nan, False
