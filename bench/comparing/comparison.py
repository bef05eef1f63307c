"""From stored runs to answers: which tracker is better, by how much, and how surely.

A tracker's repetitions on a sequence are averaged first. Trackers are then paired by sequence,
never by seed: the same seed means nothing to two methods.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.comparing.pairs import Losses, Pair, Question, Scores, paired, sign_of
from bench.protocols import STORED_ONCE, TIMING, title
from bench.reporting.doubt import LEAST_FOR_NEW, bounded_difference, bounded_score
from bench.reporting.tables import own_times
from bench.statistics.intervals import Interval
from bench.statistics.paired import (
    cells_mean,
    critical_difference,
)
from bench.store.files import ResultsError
from reports.tables import Measure
from reports.times import timed_by

if TYPE_CHECKING:
    from bench.reporting.against import Curve

__all__ = [
    "LEAST_FOR_RANKS",
    "Comparison",
    "ComparisonError",
    "Standing",
    "compare",
    "of_protocol",
    "parts_of",
]

LEAST_FOR_RANKS = 10
"""Sequences from which on mean ranks are set beside a critical difference."""

DEFAULT = "default"
"""Stands for the value of a knob that a sequence's name does not say."""

ONE_SEQUENCE = (
    "One sequence says nothing of which tracker is better; give several, or other scenes of it "
    "(NAME:scene=1)."
)


class ComparisonError(ResultsError):
    """Runs that can't be compared; says which, and what to do."""


@dataclass(frozen=True)
class Standing:
    """A tracker in a comparison; means are in the measure's unit before scaling."""

    tracker: str
    mean: float
    interval: Interval | None  # None where nothing tells of it: one repetition of few sequences
    rank: float  # mean over sequences, 1 the best
    contender: bool  # whether the data can't tell it from the best
    kept: float  # share of runs that never lost the target
    milliseconds: float  # a frame
    timed: bool  # by timing runs; else by the accuracy runs, beside other work


@dataclass(frozen=True)
class Comparison:
    """Trackers compared by one measure; `scores` are by tracker, sequence and repetition."""

    measure: Measure
    margin: float
    question: Question
    sequences: Sequence[str]
    scores: Scores
    losses: Losses
    standings: Sequence[Standing]
    pairs: Sequence[Pair]
    attributes: Sequence[Collection[str]] = ()  # that occur in each sequence, where it is known
    # Of attributes that were measured, a value a sequence; NaN where it has none.
    measured: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @cached_property
    def best(self) -> Standing:
        """The tracker with the best mean."""
        sign = sign_of(self.measure)
        return max(self.standings, key=lambda standing: sign * standing.mean)

    @property
    def critical_difference(self) -> float:
        """Of mean ranks; NaN for two trackers or too few sequences."""
        if len(self.standings) < 3 or len(self.sequences) < LEAST_FOR_RANKS:
            return nan
        return critical_difference(len(self.standings), len(self.sequences))

    @cached_property
    def repetitions(self) -> tuple[int, int]:
        """Fewest and most of any tracker on any sequence."""
        counts = [len(runs) for found in self.scores.values() for runs in found]
        return min(counts), max(counts)

    def most_different(self, count: int) -> dict[str, tuple[str, str]]:
        """So many sequences on which two trackers that were run differ most, and these two."""
        ran = {name for name, found in self.losses.items() if any(len(ends) for ends, _ in found)}
        found = {
            (abs(float(difference)), sequence): (pair.first, pair.second)
            for pair in self.pairs
            if ran >= {pair.first, pair.second}
            for sequence, difference in zip(self.sequences, pair.differences, strict=True)
        }
        chosen: dict[str, tuple[str, str]] = {}
        for (_, sequence), trackers in sorted(found.items(), reverse=True):
            if len(chosen) < count:
                chosen.setdefault(sequence, trackers)
        return chosen

    def by_part(self, pair: Pair) -> dict[tuple[str, str], NDArray[np.float64]]:
        """A pair's differences on parts of the sequences: by knob and value, by attribute.

        Knobs are what the sequences' names say (`:light=dappled`), but for their scene, where
        they take several values, `DEFAULT` where a name says none; attributes are those that some
        sequences have and some have not, and bins of those that were measured.
        """
        masks = parts_of(self.sequences, self.attributes)
        parts = {key: pair.differences[chosen] for key, chosen in masks.items()}
        for curve in self.curves_of([pair]):
            parts |= {(curve.attribute, one.words): one.scores for one in curve.bins}
        return parts

    @cached_property
    def curves(self) -> "list[Curve]":
        """Mean scores of every tracker against the attributes that were measured."""
        from bench.reporting.against import against  # brings scipy.stats, see `_standings`

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
    question: Question | None = None,
    attributes: Mapping[str, Collection[str]] | None = None,
    measured: Callable[[Sequence[str]], Mapping[str, NDArray[np.float64]]] | None = None,
) -> Comparison:
    """Compare trackers on the sequences that all of them ran on.

    Parameters
    ----------
    runs : DataFrame
        As `bench.load_results` gives them, of one experiment.
    measure : Measure
        By what; a column of `runs`. It must say which direction is better.
    margin : float
        Difference that means nothing in practice, in the unit of the column.
    trackers : sequence of str, optional
        Labels, in the order of the answers; all that are there by default.
    question : {'new sequences', 'new seeds'}, optional
        What intervals tell of; of new sequences by default where there are five or more.
    attributes : mapping of str to collection of str, optional
        Attributes that occur, by sequence.
    measured : callable, optional
        Gives values of attributes by sequence, NaN where one has none, of the sequences' names.

    Raises
    ------
    ComparisonError
        For fewer than two trackers or sequences, unknown or equal labels, runs that failed or are
        missing, and scores that are no numbers.
    """
    scored = runs[runs["protocol"] == "accuracy"]
    chosen = _chosen(scored, trackers)
    scored = scored[scored["tracker"].isin(chosen)]
    sequences = [str(name) for name in scored["sequence"].unique()]
    _check(scored, chosen, sequences, measure)
    grouped = scored.groupby(["tracker", "sequence"], observed=True, sort=False)
    cells: dict[Any, pd.DataFrame] = dict(iter(grouped))
    values = {
        name: [cells[name, sequence][measure.name].to_numpy(np.float64) for sequence in sequences]
        for name in chosen
    }
    losses = {name: [_losses(cells[name, sequence]) for sequence in sequences] for name in chosen}
    if question is None:
        question = "new sequences" if len(sequences) >= LEAST_FOR_NEW else "new seeds"
    pairs = paired(values, losses, measure, margin, question)
    standings = _standings(runs, values, losses, measure, question, pairs)
    occurring = [] if attributes is None else [attributes.get(name, ()) for name in sequences]
    about = occurring, measured(sequences) if measured else {}
    return Comparison(
        measure, margin, question, sequences, values, losses, standings, pairs, *about
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
    values: Scores,
    losses: Losses,
    measure: Measure,
    question: Question,
    pairs: Sequence[Pair],
) -> list[Standing]:
    from scipy.stats import rankdata  # half a second that `check` has no need of

    means = {name: np.array([run.mean() for run in found]) for name, found in values.items()}
    clock = timed_by(runs[(runs["protocol"] == "timing") & runs["tracker"].isin(list(values))])
    sign = sign_of(measure)
    best = max(means, key=lambda name: sign * float(means[name].mean()))
    behind = {
        pair.second if pair.answer == "better" else pair.first
        for pair in pairs
        if pair.answer in ("better", "worse") and best in (pair.first, pair.second)
    }
    ranks = rankdata([-sign * found for found in means.values()], axis=0).mean(axis=1)
    repeated = any(len(run) > 1 for found in values.values() for run in found)
    standings = []
    for name, rank in zip(means, ranks.tolist(), strict=True):
        milliseconds, timed = _times(runs[runs["tracker"] == name], clock)
        lost = np.concatenate([failed for _, failed in losses[name]])
        if question == "new sequences":
            interval: Interval | None = bounded_score(measure, means[name])
        else:
            interval = cells_mean(values[name]).interval if repeated else None
            interval = interval and interval.within(measure.least, measure.most)
        standings.append(
            Standing(
                name,
                float(means[name].mean()),
                interval,
                rank,
                name not in behind,
                float(1 - lost.mean()) if len(lost) else nan,
                milliseconds,
                timed,
            )
        )
    return standings


def _chosen(scored: pd.DataFrame, trackers: Sequence[str] | None) -> list[str]:
    known = [str(name) for name in scored["tracker"].unique()]
    chosen = list(known if trackers is None else trackers)
    for name in chosen:
        if name not in known:
            raise ComparisonError(f"there are no runs of {name!r}; there are {', '.join(known)}.")
        if chosen.count(name) > 1:
            raise ComparisonError(
                f"{name!r} is named twice; a tracker is not compared with itself."
            )
    if len(chosen) < 2:
        raise ComparisonError(f"{len(chosen)} tracker to compare: two or more are needed.")
    return chosen


def _check(
    scored: pd.DataFrame, chosen: Sequence[str], sequences: Sequence[str], measure: Measure
) -> None:
    if len(sequences) < 2:
        raise ComparisonError(ONE_SEQUENCE)
    for status in ("failed", "missing", "stale"):
        here = scored[scored["status"] == status]
        if len(here):
            row = here.iloc[0]
            why = str(row["failure"]).partition("\n")[0] if status == "failed" else ""
            raise ComparisonError(
                f"{len(here)} of {len(scored)} runs are {status}, the first that of "
                f"{row['tracker']} on {row['sequence']}{f' ({why})' if why else ''}. Run them "
                "(`trackmark run … --retry-failed` repeats failed ones), or leave them out."
            )
    there = set(zip(scored["tracker"].astype(str), scored["sequence"].astype(str), strict=True))
    for name in chosen:
        for sequence in sequences:
            if (name, sequence) not in there:
                raise ComparisonError(f"{name} was not run on {sequence}: run it, or leave it out.")
    kinds = scored.dropna(subset="fingerprint").groupby("sequence", observed=True)["fingerprint"]
    counts = kinds.nunique()
    if several := counts[counts > 1].index.tolist():
        raise ComparisonError(
            f"{several[0]} changed between runs that are stored: its pixels or its truth are not "
            "the same for all trackers. Run them again."
        )
    if measure.name not in scored:
        raise ComparisonError(f"the runs have no score {measure.name!r}.")
    undefined = scored[~np.isfinite(scored[measure.name])]
    if len(undefined):
        row = undefined.iloc[0]
        raise ComparisonError(
            f"{measure.title} of {row['tracker']} on {row['sequence']} is {row[measure.name]}: "
            "choose another --metric, or leave the sequence out."
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
