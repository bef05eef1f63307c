"""Comparison of trackers on stored runs: differences of pairs with intervals and decisions.

Repetitions on a sequence are averaged first, then the sequences of a unit. Trackers are paired by
sequence, not by repetition, because equal repetitions have no common effect on two methods.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.analysis.run_checks import (
    AllFailedError,
    ComparisonError,
    check_runs,
    compared_measure,
    same_boxes,
    selected_trackers,
)
from trackmark.bench.analysis.run_tables import not_repeatable, without_undefined
from trackmark.bench.analysis.score_tables import failed_runs
from trackmark.bench.analysis.times import TIME, clock_of, with_times
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import (
    MIN_UNITS,
    Decision,
    decide,
    interval_or_none,
    loser_of,
)
from trackmark.bench.statistics.units import StatisticalUnits, units_of
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.reports.tables import ScoreMeasure

if TYPE_CHECKING:
    from trackmark.bench.analysis.families import Families
    from trackmark.bench.analysis.published_sets import PublishedSet

Means: TypeAlias = Mapping[str, NDArray[np.float64]]
"""Means over repetitions, shape (n_sequences,), by tracker."""

DEFAULT = "default"
"""Label of a parameter value that the sequence's name omits because it is the default."""


@dataclass(frozen=True)
class Standing:
    """Tracker in a comparison; `mean` and `interval` are not multiplied by the measure's scale."""

    tracker: str
    mean: float
    interval: tuple[float, float] | None  # interval of the mean at 95 %; None for too few units
    is_unbeaten: bool  # no other tracker is better; tables mark such trackers with a star
    survival_rate: float  # share of runs that never lost the target
    ms_per_frame: float  # mean over the sequences [ms]
    fps: float  # frames per second of this mean
    clock: str  # only times of equal clocks are comparable


@dataclass(frozen=True)
class Pair:
    """Pair of trackers; differences are score of the first minus score of the second.

    Mean and interval of `decision` are positive if the first is better. `interval` is the interval
    of the plain differences, which are negative if lower scores are better.
    """

    first: str
    second: str
    differences: NDArray[np.float64]  # shape (n_sequences,), in the order of the sequences
    by_unit: NDArray[np.float64]  # shape (n_units,): mean differences
    decision: Decision  # whether the first tracker is better
    interval: Interval | None  # corrected for all pairs; None for too few units
    wins: int  # units on which the first is better
    same_boxes: int  # number of sequences with equal boxes in all runs

    @property
    def label(self) -> str:
        """Names of the trackers: `first - second`."""
        return f"{self.first} - {self.second}"

    @property
    def difference(self) -> float:
        """Mean over the units."""
        return float(self.by_unit.mean())


@dataclass(frozen=True, repr=False)
class Comparison:
    """Comparison of trackers by one measure; differences up to its margin are irrelevant."""

    measure: ScoreMeasure
    units: StatisticalUnits
    sequences: Sequence[str]
    # scores of the repetitions, by tracker and sequence
    scores: Mapping[str, Sequence[NDArray[np.float64]]]
    standings: Sequence[Standing]
    pairs: Sequence[Pair]
    main: str  # tracker `against`, or the one with the best mean
    against: bool  # True: only pairs with the main tracker are compared
    failures: Mapping[str, str]  # sentence on failed runs by tracker
    left_out: Collection[str]  # trackers whose runs all failed
    not_repeatable: Collection[str]  # trackers that gave different boxes with equal seeds
    attributes: Sequence[Collection[str]]  # attributes that occur in each sequence, if known
    # runs whose times per frame the standings have
    measured: pd.DataFrame = field(default_factory=pd.DataFrame)
    undefined: Sequence[str] = ()  # sequences without a score of any tracker, which are left out
    published: Collection[str] = ()  # trackers with published scores

    @property
    def ranked(self) -> list[Standing]:
        """Standings by their means, the best first."""
        return sorted(self.standings, key=lambda standing: -self.measure.sign * standing.mean)

    @property
    def unit_suffix(self) -> str:
        """Unit behind a score, such as ` px`; empty for pure numbers."""
        return f" {self.measure.unit}" if self.measure.unit else ""

    @property
    def main_pairs(self) -> list[Pair]:
        """Pairs with the main tracker."""
        return [pair for pair in self.pairs if self.main in (pair.first, pair.second)]

    @property
    def main_answers(self) -> dict[str, tuple[str, str]]:
        """Label and reason of the decision whether the main tracker is better, by other tracker."""
        opposites = {"better": "worse", "worse": "better"}
        answers = {}
        for pair in self.main_pairs:
            label, reason = str(pair.decision.label), pair.decision.reason
            if pair.first == self.main:
                answers[pair.second] = label, reason
            else:
                answers[pair.first] = opposites.get(label, label), reason
        return answers

    def __repr__(self) -> str:
        names = ", ".join(standing.tracker for standing in self.standings)
        return f"<Comparison of {names} by {self.measure.name} on {len(self.sequences)} sequences>"

    @property
    def repetitions(self) -> tuple[int, int]:
        """Minimum and maximum number of repetitions over trackers and sequences."""
        counts = [len(runs) for by_sequence in self.scores.values() for runs in by_sequence]
        return min(counts), max(counts)


def subsets_of(
    sequences: Sequence[str], attributes: Sequence[Collection[str]] = ()
) -> dict[tuple[str, str], NDArray[np.bool_]]:
    """Return masks of the subsets of the sequences, shape (n_sequences,), by parameter and value.

    A subset has one value of a parameter in the names of sequences (`:light=dappled`), or `DEFAULT`
    if a name does not contain it. Parameters with one value and `scene` give no subset. Attributes
    that only some sequences have are values of the parameter `attribute`. `attributes`: attributes
    of each sequence, if known.
    """
    families = [name.partition(":")[0] for name in sequences]
    options = [
        dict(part.split("=", 1) for part in name.split(":")[1:] if "=" in part)
        for name in sequences
    ]
    subsets = {}
    for parameter in sorted({parameter for row in options for parameter in row} - {"scene"}):
        # A canonical name omits default values.
        varied = {family for family, row in zip(families, options, strict=True) if parameter in row}
        values = [
            row.get(parameter, DEFAULT if family in varied else None)
            for family, row in zip(families, options, strict=True)
        ]
        distinct = sorted({value for value in values if value is not None}, key=_in_order)
        for value in distinct if len(distinct) > 1 else ():
            subsets[parameter, value] = np.array([row_value == value for row_value in values])
    for name in sorted({name for names in attributes for name in names}):
        occurs = np.array([name in names for names in attributes])
        if not occurs.all():
            subsets["attribute", name] = occurs
    return subsets


def means_of_subset(
    units: StatisticalUnits, by_sequence: NDArray[np.float64], selected: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the mean over the selected sequences of each unit that has any.

    `by_sequence`, `selected`: shape (n_sequences,).
    """
    members = [member[selected[member]] for member in units.members]
    return np.array([by_sequence[member].mean() for member in members if len(member)])


def _in_order(value: str) -> tuple[bool, float, str]:
    """Return the sort key of a parameter's value: default, numbers by size, texts."""
    try:
        number = float(value)
    except ValueError:
        number = inf
    return value != DEFAULT, number, value


def compare_runs(
    runs: Runs,
    metrics: str,
    measure: ScoreMeasure,
    trackers: Sequence[str] | None = None,
    against: str | None = None,
    *,
    protocol: str = ONE_PASS,
    published: "Path | PublishedSet | None" = None,
    by_scene: bool = False,
    families: "Families | None" = None,
) -> Comparison:
    """Compare trackers by a score of metrics on runs by one protocol; see `compare_trackers`.

    The title of the measure names the protocol, but one-pass evaluation only if runs by other
    protocols exist. `published` has scores of further trackers: a CSV file or a published set.
    """
    other_protocols = [name for name in runs.protocols if name != protocol]
    if protocol not in runs.protocols:
        remedy = f" Stored runs used {', '.join(other_protocols)}. Select one with --protocol."
        raise ComparisonError(
            f"no stored run used the protocol {protocol}.{remedy if other_protocols else ''}"
        )
    if other_protocols or protocol != ONE_PASS:
        measure = replace(measure, title=f"{measure.title}, protocol {protocol}")
    scored = runs.scored(metrics, protocol, strict=True)
    if protocol != ONE_PASS:
        scored = scored.assign(first_loss=nan)  # is defined for one-pass runs only
    further: list[str] = []
    if published is not None:
        # Files of users are read only on request; most comparisons do not need their reader.
        from trackmark.bench.analysis.published_scores import with_published

        scored, further = with_published(scored, published, measure)
        trackers = None if trackers is None else [*trackers, *further]
    return compare_trackers(
        scored,
        runs.timed,
        measure,
        trackers,
        against,
        by_scene=by_scene,
        families=families,
        attributes=runs.attributes,
        same_boxes=same_boxes(runs, protocol),
        not_repeatable=not_repeatable(runs.table),
        published=further,
    )


def rank_among_published(runs: Runs, published: "Path | PublishedSet") -> Comparison:
    """Compare one-pass runs with published scores, by the metrics of these scores."""
    metrics = getattr(published, "metrics", DEFAULT_METRICS)
    measure = compared_measure(metrics, getattr(published, "measure", "mean_overlap"))
    return compare_runs(runs, metrics, measure, published=published)


def compare_trackers(
    scored: pd.DataFrame,
    timed: pd.DataFrame,
    measure: ScoreMeasure,
    trackers: Sequence[str] | None = None,
    against: str | None = None,
    *,
    by_scene: bool = False,
    families: "Families | None" = None,
    attributes: Mapping[str, Collection[str]] | None = None,
    same_boxes: Mapping[tuple[str, str], int] | None = None,
    not_repeatable: Collection[str] = (),
    published: Collection[str] = (),
) -> Comparison:
    """Compare trackers on the sequences that all of them ran on.

    Sequences on which no run has a score, such as those of one frame, are left out. Raises
    `ComparisonError` for runs that cannot be compared, `AllFailedError` if all failed.

    Parameters
    ----------
    scored, timed : DataFrame
        Runs by one protocol, as `Runs.scored` returns them, and timing runs.
    measure : ScoreMeasure
        Column of `scored` with direction and margin.
    trackers : sequence of str, optional
        Labels; by default all trackers of `scored`.
    against : str, optional
        Tracker to compare with every other tracker; all pairs by default.
    by_scene : bool
        Whether the units are scenes, also for several families.
    families : Families, optional
        Declared families, which are then the units.
    attributes : mapping of str to collection of str, optional
        Attributes by sequence.
    same_boxes : mapping of (str, str) to int, optional
        Number of sequences with equal boxes, by pair of trackers.
    not_repeatable : collection of str
        Trackers that gave different boxes in repeated runs.
    published : collection of str
        Trackers whose scores are published. They are compared with the other trackers, but not
        with each other, so that the intervals are corrected for these pairs only.
    """
    labels = selected_trackers(scored, trackers, against)
    scored = scored[scored["tracker"].isin(labels)]
    failures = failed_runs(scored, "0" if measure.direction == "higher" else "the worst score")
    scored = scored[~scored["tracker"].isin(failures.left_out)]
    labels = [name for name in labels if name not in failures.left_out]
    if not labels:
        raise AllFailedError("; ".join(f"{name}: {note}" for name, note in failures.notes.items()))
    scored, undefined = without_undefined(scored, measure.name)
    timed = timed[timed["tracker"].isin(labels) & ~timed["sequence"].isin(undefined)]
    sequences = scored["sequence"].astype(str).unique().tolist()
    check_runs(scored, labels, sequences, measure)
    grouped = scored.groupby(["tracker", "sequence"], observed=True, sort=False)[measure.name]
    by_pair = {pair: values.to_numpy(np.float64) for pair, values in grouped}
    scores: dict[str, list[NDArray[np.float64]]] = {}
    means: dict[str, NDArray[np.float64]] = {}
    for name in labels:
        scores[name] = [by_pair[name, sequence] for sequence in sequences]
        means[name] = np.array([*map(np.mean, scores[name])])
    declared = None if families is None else families.by_name(sequences)
    units = units_of(sequences, "scene" if by_scene else None, declared)
    pairs = _pairs(means, units, measure, against, same_boxes or {}, published)
    times, measured = with_times(scored, timed)
    # A published tracker is rarely called better, because intervals are corrected for many pairs.
    beaten = {loser_of(pair.first, pair.second, pair.decision) for pair in pairs}
    has_marks = pairs and len(units) >= MIN_UNITS and not published
    unbeaten = means.keys() - beaten if has_marks else ()
    standings = _standings(times, clock_of(measured), means, units, measure, unbeaten)
    unpublished = [standing for standing in standings if standing.tracker not in published]
    best = max(unpublished or standings, key=lambda standing: measure.sign * standing.mean)
    return Comparison(
        measure=measure,
        units=units,
        sequences=sequences,
        scores=scores,
        standings=standings,
        pairs=pairs,
        main=against or best.tracker,
        against=against is not None,
        failures=failures.notes,
        left_out=failures.left_out,
        not_repeatable=[name for name in labels if name in not_repeatable],
        attributes=[(attributes or {}).get(name, ()) for name in sequences],
        measured=measured,
        undefined=undefined,
        published=published,
    )


def _standings(
    runs: pd.DataFrame,
    clocks: Mapping[str, str],
    means: Means,
    units: StatisticalUnits,
    measure: ScoreMeasure,
    unbeaten: Collection[str],
) -> list[Standing]:
    by_sequence = runs.groupby(["tracker", "sequence"], observed=True)[TIME.name].mean()
    times = by_sequence.groupby("tracker", observed=True).mean().to_dict()
    standings = []
    for name, values in zip(means, units.means(list(means.values())), strict=True):
        interval = interval_or_none(values, 1, measure.minimum, measure.maximum)
        # Only one-pass runs have a first loss.
        ended = runs[runs["tracker"] == name].reindex(columns=["first_loss", "frames"]).dropna()
        survival = float((ended["first_loss"] >= ended["frames"]).mean())
        mean, mark = float(values.mean()), name in unbeaten
        time = times.get(name, nan)
        fps, clock = 1e3 / time if time > 0 else nan, clocks.get(name, "")
        standings.append(Standing(name, mean, interval, mark, survival, time, fps, clock))
    return standings


def _pairs(
    means: Means,
    units: StatisticalUnits,
    measure: ScoreMeasure,
    against: str | None,
    same_boxes: Mapping[tuple[str, str], int],
    published: Collection[str],
) -> list[Pair]:
    """Compare all pairs, or `against` (if it has a mean) with every other tracker.

    Two published trackers form no pair.
    """
    names = [pair for pair in combinations(means, 2) if not {*pair} <= {*published}]
    if against is not None:
        names = [(against, name) for name in means if name != against and against in means]
    sign, limit = measure.sign, measure.maximum - measure.minimum
    pairs = []
    for first, second in names:
        differences = means[first] - means[second]
        by_unit = units.means(differences)
        decision = decide(
            sign * by_unit, measure.margin, len(names), limit=limit, unit=units.plural
        )
        interval = decision.interval
        if interval is None:
            decision = replace(decision, reason=decision.reason + units.remedy)
        elif sign < 0:
            interval = Interval(0.0 - interval.high, 0.0 - interval.low)  # without -0
        same = same_boxes.get((first, second), same_boxes.get((second, first), 0))
        wins = int((sign * by_unit > 0).sum())
        pairs.append(Pair(first, second, differences, by_unit, decision, interval, wins, same))
    return pairs
