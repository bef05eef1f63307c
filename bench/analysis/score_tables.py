"""Tables of scores.

Scores are averaged over repetitions first and then over sequences, so that all sequences have equal
weights. A mean with a missing run is missing itself, and the table shows the number of missing
runs. A failed run has the worst score.
"""

import re
from collections.abc import Sequence
from functools import partial
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.statistics.rules import MIN_UNITS, interval_or_none, star_marks
from trackmark.bench.statistics.units import StatisticalUnits, units_of
from trackmark.reports.tables import MISSING, Cell, ScoreMeasure, Table

NOT_RUN = "not run"
_STATUS_MEANINGS = {
    "missing": "of the runs that were asked for",
    NOT_RUN: "of the sequences",
}
_FRAME = re.compile(r"^(frame \d+|\S+\.(?:png|jpe?g|bmp|tiff?|webp|p[gp]m)): ", re.IGNORECASE)


def with_not_run(runs: pd.DataFrame) -> pd.DataFrame:
    """Add a `not run` row for each pair of tracker and sequence without a run.

    Means of trackers over different sequences are not comparable.
    """
    pairs = runs[["tracker", "sequence"]].drop_duplicates().astype(str)
    trackers, sequences = pairs["tracker"].unique(), pairs["sequence"].unique()
    every = pd.MultiIndex.from_product([trackers, sequences], names=[*pairs])
    absent = every[~every.isin(pd.MultiIndex.from_frame(pairs))].to_frame(index=False)
    not_run = absent.assign(repetition=0, status=NOT_RUN)
    return pd.concat([runs, not_run], ignore_index=True) if len(not_run) else runs


def mean_table(
    runs: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
    title: str,
    metrics: str,
    *,
    skip_undefined: bool = False,
) -> Table:
    """Make a table of trackers by measures, averaged over units, with intervals and marks.

    `runs`: one row per run with `tracker`, `sequence`, `repetition`, `status`, `failure` and one
    column per measure. A `status` of `missing` or `stale` makes a mean missing. Failed runs count
    if they have a score. `title`: start of the caption. `skip_undefined`: average over the runs
    that have a score; by default the mean is missing if one is missing.
    """
    runs = with_not_run(runs)
    sequences = runs["sequence"].astype(str).unique().tolist()
    units = units_of(sequences)
    mean, by_unit = tracker_means(runs, measures, skip_undefined=skip_undefined)
    # The spread over repetitions is defined if all sequences have equally many.
    labels = ["tracker", "repetition"]
    by_pass = _statistic("mean", measures, labels, runs, skip_undefined=skip_undefined)
    spread = _statistic("std", measures, ["tracker"], by_pass, skip_undefined=skip_undefined)
    sizes = runs.groupby(["tracker", "sequence"], sort=False).size().groupby("tracker", sort=False)
    spread = spread.where(sizes.min() == sizes.max())
    values = _values(runs, mean, spread, mean * np.nan, measures)
    values = _with_intervals(values, by_unit, measures)
    meaning = (
        f"{means_over(sequences, len(units))}; metrics {metrics}. {meaning_of_intervals(units)}"
    )
    notes = notes_of(runs, measures[0].name)
    return _table("summary", f"{title}: {meaning}", values, notes, measures, metrics)


def tracker_means(
    runs: pd.DataFrame, measures: Sequence[ScoreMeasure], *, skip_undefined: bool = False
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the means by tracker, and by tracker and unit, with a column per measure.

    Parameters are as for `mean_table`. Repetitions are averaged first, then sequences, then units.
    """
    mean_by = partial(_statistic, "mean", measures, skip_undefined=skip_undefined)
    sequences = runs["sequence"].astype(str)
    units, unit_of = units_of(sequences.unique().tolist()), pd.Series("", sequences.unique())
    for label, members in zip(units.labels, units.members, strict=True):
        unit_of.iloc[members] = label
    runs = runs.assign(unit=sequences.map(unit_of))
    by_unit = mean_by(["tracker", "unit"], mean_by(["tracker", "unit", "sequence"], runs))
    return mean_by(["tracker"], by_unit), by_unit


def means_over(sequences: Sequence[str], n_units: int) -> str:
    """Return the part of a caption that describes means over sequences or units."""
    names = ", ".join(sequences) if len(sequences) <= 4 else f"{len(sequences)} sequences"
    names += f" in {n_units} units" if n_units < len(sequences) else ""
    return f"means over {names}, each counting once"


def meaning_of_intervals(units: StatisticalUnits) -> str:
    """Return the part of a caption that explains intervals and marks."""
    if len(units) < MIN_UNITS:
        plural = units.plural if len(units) != 1 else units.unit_kind
        return (
            f"{len(units)} {plural}: too few for intervals and marks ({MIN_UNITS} needed). "
            "± standard deviation over repetitions."
        )
    return (
        f"[from, to]: 95 % interval of the mean {units.scope}. * or bold: no other tracker is "
        "better, by the interval of the difference, corrected for all pairs."
    )


def means_by_tracker(summary: Table, measure: str) -> pd.DataFrame:
    """Return the data of a `mean_table` on a measure, with a row per tracker."""
    return summary.records[summary.records["measure"] == measure].set_index("tracker")


def ranked_trackers(summary: Table) -> list[str]:
    """Return the trackers by mean overlap, the best first; those without a mean come last."""
    overlaps = means_by_tracker(summary, "mean_overlap")["mean"]
    return [*overlaps.sort_values(ascending=False, kind="stable").index]


def sequence_table(
    runs: pd.DataFrame, measures: Sequence[ScoreMeasure], title: str, metrics: str
) -> Table:
    """Make a table of trackers by measures on every sequence; parameters as for `mean_table`.

    There are no marks: one sequence is one unit.
    """
    names = ["sequence", "tracker"]
    mean, spread = (_statistic(name, measures, names, runs) for name in ("mean", "std"))
    index = pd.MultiIndex.from_product([runs[name].unique() for name in names], names=names)
    mean = mean.reindex(index[index.isin(mean.index)])
    values = _values(runs, mean, spread, mean, measures)
    caption = (
        f"{title}: every sequence; metrics {metrics}. Means and ± standard deviations over "
        "repetitions."
    )
    notes = notes_of(runs, measures[0].name)
    return _table("sequences", caption, values, notes, measures, metrics)


def _table(
    name: str,
    caption: str,
    values: pd.DataFrame,
    notes: list[str],
    measures: Sequence[ScoreMeasure],
    metrics: str,
) -> Table:
    """Return a table of `_values`, which become its data."""
    labels = [str(level) for level in values.index.names]
    listed = values.reset_index()
    listed[labels] = listed[labels].astype(str)
    pairs = zip(values.itertuples(), cycle(measures), strict=False)
    cells = [Cell(_cell_text(value, measure), bool(value.marked)) for value, measure in pairs]
    n = len(measures)
    rows = [
        [*map(Cell, row), *cells[index * n : (index + 1) * n]]
        for index, row in enumerate(listed[labels][::n].to_numpy())
    ]
    listed.insert(len(labels), "metrics", metrics)
    headings = [*labels, *(measure.heading for measure in measures)]
    ranks = [measure.rank for measure in measures]
    return Table(name, caption, headings, len(labels), rows, notes, listed, ranks)


def _statistic(
    name: str,
    measures: Sequence[ScoreMeasure],
    levels: list[str],
    runs: pd.DataFrame,
    *,
    skip_undefined: bool = False,
) -> pd.DataFrame:
    """Return the mean or standard deviation of the scores by labels.

    A value is NaN if a score of the group is missing, unless `skip_undefined`.
    """
    columns = dict.fromkeys(name for m in measures for name in (m.name, m.out_of) if name in runs)
    grouped = runs.groupby(levels, sort=False)[[*columns]]
    is_whole = grouped.count().eq(grouped.size(), axis=0) | skip_undefined
    statistic: pd.DataFrame = grouped.agg(name)
    return statistic.where(is_whole)


def _values(
    runs: pd.DataFrame,
    mean: pd.DataFrame,
    spread: pd.DataFrame,
    out_of: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
) -> pd.DataFrame:
    """Return the values of a table: a row per measure for each row of `mean`.

    A mean is missing if a run does not count; `lacking` is then the reason.
    """
    names = [measure.name for measure in measures]
    reasons = missing_reasons(runs, mean.index, names[0])
    sizes = runs.groupby(list(mean.index.names), sort=False).size().reindex(mean.index)

    def column(values: pd.DataFrame, names: list[str]) -> NDArray[np.float64]:
        present = values.reindex(mean.index, columns=names).where(reasons == "")
        return present.to_numpy(np.float64).ravel()

    columns = {
        "measure": names * len(mean),
        "mean": column(mean, names),
        "standard_deviation": column(spread, names),
        "low": np.nan,
        "high": np.nan,
        "marked": False,
        "out_of": column(out_of, [measure.out_of for measure in measures]),
        "runs": np.repeat(sizes.to_numpy(), len(names)),
        "lacking": np.repeat(reasons, len(names)),
    }
    return pd.DataFrame(columns, index=mean.index.repeat(len(names)))


def missing_reasons(runs: pd.DataFrame, index: pd.Index, score: str) -> "pd.Series[str]":
    """Return why the means with these labels are missing, such as `2 of 5 stale`; empty if not.

    A mean is missing if a run does not count. Failed runs count if they have a score `score`.
    """
    levels = list(index.names)
    uncounted = runs[~counted(runs, score)].groupby(levels, sort=False)["status"]
    kinds = uncounted.agg(lambda statuses: " or ".join(statuses.unique()))
    sizes = runs.groupby(levels, sort=False).size().reindex(kinds.index)
    reasons = uncounted.size().astype(str) + " of " + sizes.astype(str) + " " + kinds
    return reasons.reindex(index, fill_value="")


def _with_intervals(
    values: pd.DataFrame, by_unit: pd.DataFrame, measures: Sequence[ScoreMeasure]
) -> pd.DataFrame:
    """Return the values with intervals and marks; missing means stay missing.

    `by_unit`: means by tracker and unit.
    """
    means = values["mean"].to_numpy().reshape(-1, len(measures))
    intervals = np.full((*means.shape, 2), np.nan)
    marked = np.zeros(means.shape, bool)
    every = pd.MultiIndex.from_product([by_unit.index.unique(level) for level in (0, 1)])
    for column, measure in enumerate(measures):
        present = np.flatnonzero(~np.isnan(means[:, column]))
        if not len(present):
            continue
        table = by_unit[measure.name].reindex(every).to_numpy(np.float64)
        table = table.reshape(len(means), -1)[present]
        defined = ~np.isnan(table).all(axis=0)
        intervals[present, column], marked[present, column] = intervals_and_marks(
            table[:, defined], measure
        )
    low, high = intervals.reshape(-1, 2).T
    return values.assign(low=low, high=high, marked=marked.ravel())


def intervals_and_marks(
    values: NDArray[np.float64], measure: ScoreMeasure
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return interval (trackers, 2) and mark (trackers,) of each mean over units.

    `values`: shape (trackers, units). A tracker with an infinite value has neither.
    """
    intervals, marks = np.full((len(values), 2), np.nan), np.zeros(len(values), bool)
    finite = np.flatnonzero(np.isfinite(values).all(axis=1))
    if measure.direction is None or not len(finite):
        return intervals, marks
    for tracker in finite:
        interval = interval_or_none(values[tracker], 1, measure.minimum, measure.maximum)
        intervals[tracker] = interval or np.nan
    higher, limit = measure.direction == "higher", measure.maximum - measure.minimum
    marks[finite] = star_marks(values[finite], measure.margin, higher=higher, limit=limit)
    return intervals, marks


def _cell_text(value: Any, measure: ScoreMeasure) -> str:
    """Return the text of a row of `_values`."""
    if value.lacking:
        return f"{MISSING} ({value.lacking})"
    if np.isnan(value.mean):
        return MISSING
    if measure.never and value.mean == value.out_of:
        return measure.never
    is_count = bool(measure.out_of) and value.mean.is_integer()
    digits = 0 if is_count and not value.standard_deviation > 0 else measure.decimals
    values = value.mean, value.standard_deviation, value.low, value.high
    mean, spread, low, high = (f"{number * measure.scale:.{digits}f}" for number in values)
    if np.isfinite(value.low):
        mean += f" [{low}, {high}]"
    elif np.isfinite(value.standard_deviation):
        mean += f" ±{spread}"
    if np.isfinite(value.out_of) and not measure.never:
        mean += f" of {value.out_of * measure.scale:.0f}"
    return mean


def counted(runs: pd.DataFrame, score: str) -> "pd.Series[bool]":
    """Return a mask of the runs in a mean: finished runs, and failed runs with a score."""
    finished = runs["status"] == "finished"
    if score not in runs:
        return finished
    return finished | ((runs["status"] == "failed") & runs[score].notna())


def failure_notes(
    runs: pd.DataFrame, worst: str = "the worst score", every: str = "left out"
) -> dict[str, str]:
    """Return a note by tracker with failed runs: their number, and the reason of the first one.

    The note states that failed runs count as `worst`, unless this is empty, because they have no
    score. For a tracker whose runs all failed, it states `every`.
    """
    notes = dict[str, str]()
    for tracker, rows in runs.groupby("tracker", sort=False):
        failed = rows[rows["status"] == "failed"]
        if failed.empty:
            continue
        treatment = every if len(failed) == len(rows) else worst and f"counted as {worst}"
        first = failed.iloc[0]
        reason = _FRAME.sub("", str(first["failure"]).partition("\n")[0])
        notes[str(tracker)] = (
            f"{len(failed)} of {len(rows)} runs failed{treatment and f' ({treatment})'}: "
            f"sequence {first['sequence']}, {reason}"
        )
    return notes


class FailedRuns(NamedTuple):
    """Failed runs of a comparison or table."""

    notes: dict[str, str]  # by tracker: number of failed runs, and reason of the first failure
    left_out: list[str]  # trackers whose runs all failed


def failed_runs(runs: pd.DataFrame, counted: str = "the worst score") -> FailedRuns:
    """Return notes on the trackers with failed runs, for runs by one protocol.

    `counted`: score of a failed run in the notes, for example `0` for an overlap.

    >>> runs = pd.DataFrame({"tracker": ["a", "a"], "sequence": ["cup", "box"]})
    >>> runs = runs.assign(status=["failed", "finished"], failure=["frame 3: ValueError: no", ""])
    >>> failed_runs(runs, "0").notes
    {'a': '1 of 2 runs failed (counted as 0): sequence cup, ValueError: no'}
    """
    notes = failure_notes(runs, counted)
    succeeded = set(runs["tracker"][runs["status"] != "failed"])
    return FailedRuns(notes, [tracker for tracker in notes if tracker not in succeeded])


def stale_notes(runs: pd.DataFrame) -> dict[str, str]:
    """Return a note by tracker with stale runs, which names up to three of their sequences."""
    notes = dict[str, str]()
    for tracker, rows in runs[runs["status"] == "stale"].groupby("tracker", sort=False):
        sequences = [*map(str, rows["sequence"].unique())]
        more = f" and {len(sequences) - 3} more" if len(sequences) > 3 else ""
        notes[str(tracker)] = (
            f"stale: {tracker}, {len(rows)} by another version of the tracker or the sequence "
            f"({', '.join(sequences[:3])}{more}). Run them again."
        )
    return notes


def notes_of(runs: pd.DataFrame, score: str) -> list[str]:
    """Return notes on failed and missing runs and malformed boxes by tracker.

    `score`: column of scores; failed runs with a value in this column have the worst score.
    """
    worst = "the worst score" if (counted(runs, score) & (runs["status"] == "failed")).any() else ""
    notes = [f"{tracker}: {note}" for tracker, note in failure_notes(runs, worst).items()]
    for status in ("missing", NOT_RUN):
        selected = runs[runs["status"] == status]
        counts = selected.groupby("tracker", sort=False).size()
        notes += [
            f"{status}: {tracker}, {count} {_STATUS_MEANINGS[status]}"
            for tracker, count in counts.items()
        ]
    notes += stale_notes(runs).values()
    if "malformed_boxes" in runs:
        finished = runs[runs["status"] == "finished"]
        sums = finished.groupby("tracker", sort=False)["malformed_boxes"].sum()
        notes += [
            f"malformed: {tracker}, {count:.0f} boxes not finite with a positive size: misses"
            for tracker, count in sums[sums > 0].items()
        ]
    return notes
