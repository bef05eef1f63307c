"""From stored runs to answers: which tracker is better, by how much, and how surely.

A tracker's repetitions on a sequence are averaged first, then the sequences of a unit. Trackers are
paired by sequence, never by seed: the same seed means nothing to two methods.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.comparing.pairwise import Losses, Pair, Scores, compare_pairs, sign_of
from bench.protocols import STORED_ONCE, TIMING, title
from bench.reporting.failed_runs import failed_runs
from bench.reporting.tables import own_times
from bench.reporting.uncertainty import bounded_difference, bounded_score
from bench.statistics.intervals import Interval
from bench.statistics.rules import interval_or_none, star_marks
from bench.statistics.units import Units, units_of
from bench.store.files import ResultsError
from reports.tables import Measure
from reports.times import timed_by

if TYPE_CHECKING:
    from bench.reporting.against import Curve

__all__ = [
    "AllFailedError",
    "Comparison",
    "ComparisonError",
    "Standing",
    "compare",
    "means_in_part",
    "of_protocol",
    "parts_of",
]

DEFAULT = "default"
"""Stands for the value of a parameter that a sequence's name does not set."""


class ComparisonError(ResultsError):
    """Runs that cannot be compared; the message names them and the remedy."""


class AllFailedError(ComparisonError):
    """Every run of every tracker failed."""


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
    # Of attributes that were measured, a value a sequence; NaN where it has none.
    measured: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

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

    @cached_property
    def curves(self) -> "list[Curve]":
        """Mean scores of every tracker against the attributes that were measured."""
        from bench.reporting.against import against  # brings scipy.stats

        means = {name: np.array([run.mean() for run in runs]) for name, runs in self.scores.items()}
        return against(means, self.measured, partial(bounded_score, self.measure))

    def curves_of(self, pairs: Sequence[Pair]) -> "list[Curve]":
        """Differences of pairs against them; p is corrected for all of these together."""
        from bench.reporting.against import against  # as above

        differences = {f"{pair.first} - {pair.second}": pair.differences for pair in pairs}
        return against(differences, self.measured, partial(bounded_difference, self.measure))


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
    measured: Callable[[Sequence[str]], Mapping[str, NDArray[np.float64]]] | None = None,
    same_boxes: Mapping[tuple[str, str], int] | None = None,
    not_repeatable: Collection[str] = (),
) -> Comparison:
    """Compare trackers on the sequences that all of them ran on.

    Parameters
    ----------
    runs : DataFrame
        As `bench.load_results` gives them, of one experiment, with scores of failed runs as
        `bench.reporting.failed_runs.with_worst_scores` fills them in.
    measure : Measure
        Compared score: a column of `runs` that has a direction.
    margin : float
        Differences up to this are irrelevant, in the unit of the column.
    trackers : sequence of str, optional
        Labels, in the order of the answers; all stored ones by default.
    against : str, optional
        Tracker that is compared with each other one; all pairs by default.
    by_scene : bool
        Whether scenes are the units although there are several families.
    attributes : mapping of str to collection of str, optional
        Attributes that occur, by sequence.
    measured : callable, optional
        Returns values of attributes by sequence, NaN if it has none, of the sequences' names.
    same_boxes : mapping of pair to int, optional
        Number of sequences on which two trackers gave the same boxes.
    not_repeatable : collection of str
        Trackers of which a stored run with the same seed has other boxes.

    Raises
    ------
    ComparisonError
        For fewer than two trackers, unknown or equal labels, missing runs, and scores that are not
        finite.
    """
    scored = runs[runs["protocol"] == "accuracy"]
    chosen = _chosen(scored, trackers, against)
    scored = scored[scored["tracker"].isin(chosen)]
    counted = "0" if measure.direction == "higher" else "the worst score"
    failures = failed_runs(scored, counted)
    scored = scored[~scored["tracker"].isin(failures.left_out)]
    chosen = [name for name in chosen if name not in failures.left_out]
    if not chosen:
        raise AllFailedError("; ".join(f"{name}: {note}" for name, note in failures.notes.items()))
    sequences = [str(name) for name in scored["sequence"].unique()]
    _check(scored, chosen, sequences, measure)
    grouped = scored.groupby(["tracker", "sequence"], observed=True, sort=False)
    cells: dict[Any, pd.DataFrame] = dict(iter(grouped))
    values = {
        name: [cells[name, sequence][measure.name].to_numpy(np.float64) for sequence in sequences]
        for name in chosen
    }
    losses = {name: [_losses(cells[name, sequence]) for sequence in sequences] for name in chosen}
    units = units_of(sequences, "scene" if by_scene else None)
    means = {name: np.array([run.mean() for run in of]) for name, of in values.items()}
    against = None if against in failures.left_out else against
    return Comparison(
        measure,
        margin,
        units,
        sequences,
        values,
        losses,
        _standings(runs, means, losses, units, measure, margin),
        compare_pairs(means, units, measure, margin, against, same_boxes),
        against,
        failures.notes,
        failures.left_out,
        [name for name in chosen if name in not_repeatable],
        [] if attributes is None else [attributes.get(name, ()) for name in sequences],
        measured(sequences) if measured else {},
    )


def of_protocol(runs: pd.DataFrame, stored: str, measure: Measure) -> tuple[pd.DataFrame, Measure]:
    """Runs by one protocol as `compare` takes them, and the measure, whose title says which.

    `runs`: as `bench.load_results` gives them. `stored`: what those by the protocol are filed
    under. Timing runs stay beside them. When a target was lost is told of one pass alone; and its
    title says nothing, where nothing else is there.

    Raises `ComparisonError` where there are none.
    """
    there = list(map(str, runs["protocol"].unique()))
    others = [title(name) for name in there if name not in (stored, TIMING)]
    if stored not in there:
        known = f"; there are some by {', '.join(others)} (--protocol)" if others else ""
        raise ComparisonError(f"there are no runs by the protocol {title(stored)}{known}.")
    if others or stored != STORED_ONCE:
        measure = replace(measure, title=f"{measure.title}, protocol {title(stored)}")
    if stored == STORED_ONCE:
        return runs, measure
    protocols = runs["protocol"].astype(str)
    chosen = runs[protocols.isin([stored, TIMING])]
    known_as = protocols[chosen.index].replace(stored, STORED_ONCE)
    return chosen.assign(protocol=known_as, first_loss=nan), measure


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


def _chosen(scored: pd.DataFrame, trackers: Sequence[str] | None, against: str | None) -> list[str]:
    """Return the labels of the compared trackers."""
    stored = [str(name) for name in scored["tracker"].unique()]
    chosen = list(stored if trackers is None else trackers)
    if against is not None and against not in chosen:
        chosen.insert(0, against)
    for name in chosen:
        if name not in stored:
            raise ComparisonError(
                f"{name!r}: no stored runs of this tracker. Stored are {', '.join(stored)}."
            )
        if chosen.count(name) > 1:
            raise ComparisonError(
                f"{name!r} is named twice. Name each tracker once; a tracker is not compared with "
                "itself."
            )
    if len(chosen) < 2:
        raise ComparisonError(f"{len(chosen)} tracker to compare. Name two or more.")
    return chosen


def _check(
    scored: pd.DataFrame, chosen: Sequence[str], sequences: Sequence[str], measure: Measure
) -> None:
    """Raise `ComparisonError` unless all runs can be compared."""
    for status in ("missing", "stale"):
        here = scored[scored["status"] == status]
        if len(here):
            row = here.iloc[0]
            raise ComparisonError(
                f"tracker {row['tracker']}, sequence {row['sequence']}, repetition "
                f"{row['repetition']}: the run is {status} ({len(here)} of {len(scored)} runs "
                "are). All runs are needed. Execute them with `trackmark run` or with "
                "--sequences, or name other trackers."
            )
    present = set(zip(scored["tracker"].astype(str), scored["sequence"].astype(str), strict=True))
    for name in chosen:
        for sequence in sequences:
            if (name, sequence) not in present:
                raise ComparisonError(
                    f"tracker {name}, sequence {sequence}: the run is missing. Execute it with "
                    "`trackmark run` or with --sequences, or name other trackers."
                )
    kinds = scored.dropna(subset="fingerprint").groupby("sequence", observed=True)["fingerprint"]
    counts = kinds.nunique()
    if several := counts[counts > 1].index.tolist():
        raise ComparisonError(
            f"sequence {several[0]}: its images or its ground truth changed between stored runs. "
            "Run all trackers on it again."
        )
    if measure.name not in scored:
        raise ComparisonError(f"the runs have no score {measure.name!r}.")
    undefined = scored[~np.isfinite(scored[measure.name])]
    if len(undefined):
        row = undefined.iloc[0]
        raise ComparisonError(
            f"tracker {row['tracker']}, sequence {row['sequence']}: {measure.title} is "
            f"{row[measure.name]}. Choose another --metric, or omit the sequence."
        )


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
