"""Tables of scores: one model for all renderers.

Scores are averaged over repetitions first and then over sequences, so that all sequences have equal
weights. A mean with a missing run is missing itself, and the table shows the number of missing
runs. A failed run has the worst score.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Direction: TypeAlias = Literal["higher", "lower"]

MISSING = "—"
NOT_RUN = "not run"
_STATUS_MEANINGS = {
    "missing": "of the runs that were asked for",
    "stale": "by another version of the tracker or the sequence",
    NOT_RUN: "of the sequences",
}
_FRAME = re.compile(r"^(frame \d+|\S+\.(?:png|jpe?g|bmp|tiff?|webp|p[gp]m)): ", re.IGNORECASE)

_NO_FRAME = "none"  # instead of a frame number
_NUMBER = re.compile(
    r"[\[(~<>≤≥]*\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?(?=$|[\s,;%\])±–*])",
    re.IGNORECASE | re.ASCII,
)
"""Number at the start of a text, such as `~3.1`, `[-0.2, 0.1]` or `54 of 99`."""


@dataclass(frozen=True)
class ScoreMeasure:
    """Column of a table: a score and its format."""

    name: str  # column of the data frame of runs
    title: str  # column heading
    unit: str = ""  # unit of the printed value; empty for pure numbers
    direction: Direction | None = None  # better values; None if no value is better
    decimals: int = 2  # number of printed decimals
    scale: float = 1.0  # factor from score to printed value (1000 prints seconds as ms)
    out_of: str = ""  # column with the maximum of a count, printed as `k of n`
    never: str = ""  # text for a score that equals this maximum, instead of `n of n`
    rank: int = 0  # a narrow terminal omits columns of the highest rank first
    least: float = -math.inf  # lowest possible score
    most: float = math.inf  # highest possible score
    margin: float = 0.0  # difference of scores that is irrelevant in practice

    @property
    def head(self) -> str:
        """Column heading with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True)
class Cell:
    """Cell of a table: its text, and whether it is marked by a star or bold type."""

    text: str
    best: bool = False


@dataclass(frozen=True)
class Table:
    """Table, independent of an output format."""

    name: str  # file name without suffix
    caption: str
    heads: list[str]  # column headings
    n_labels: int  # number of leading columns with the labels of a row
    rows: list[list[Cell]]
    notes: list[str] = field(default_factory=list)  # below the table: failed and missing runs
    data: pd.DataFrame = field(default_factory=pd.DataFrame)  # one row per value, unrounded
    ranks: list[int] = field(default_factory=list)  # `ScoreMeasure.rank` of the score columns


def text_table(
    name: str,
    caption: str,
    heads: Iterable[str],
    rows: list[list[str]],
    n_labels: int = 1,
    notes: Iterable[str] = (),
) -> Table:
    """Return a table of texts, which are also its data."""
    cells = [[Cell(text) for text in row] for row in rows]
    data = pd.DataFrame(rows, columns=[*heads])
    return Table(name, caption, [*heads], n_labels, cells, [*notes], data)


def complete(runs: pd.DataFrame) -> pd.DataFrame:
    """Add a `not run` row for each pair of tracker and sequence without a run.

    Means of trackers over different sequences are not comparable.
    """
    pairs = runs[["tracker", "sequence"]].drop_duplicates().astype(str)
    present = set(pairs.itertuples(index=False, name=None))
    not_run = [
        {"tracker": tracker, "sequence": sequence, "repetition": 0, "status": NOT_RUN}
        for tracker in pairs["tracker"].unique()
        for sequence in pairs["sequence"].unique()
        if (tracker, sequence) not in present
    ]
    return pd.concat([runs, pd.DataFrame(not_run)], ignore_index=True) if not_run else runs


class Uncertainty(NamedTuple):
    """Intervals and marks of the means of a column, one per tracker."""

    intervals: Sequence[tuple[float, float] | None]
    marks: Sequence[bool]


Uncertainties: TypeAlias = Callable[[NDArray[np.float64], ScoreMeasure], Uncertainty]
"""Function `(values, measure) -> Uncertainty`, with values of shape (trackers, units)."""


def summary_table(
    runs: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
    title: str,
    preset: str,
    uncertainties: Uncertainties | None = None,
    meaning: str = "± standard deviation over repetitions.",
    *,
    skip_undefined: bool = False,
) -> Table:
    """Make a table of trackers by measures, averaged over units.

    Parameters
    ----------
    runs : DataFrame
        One row per run with `tracker`, `sequence`, `repetition`, `status`, `failure` and one column
        per measure. Optional is `unit`, the unit of the average; by default the sequence. A
        `status` of `missing` or `stale` makes a mean missing. Failed runs count if they have a
        score.
    measures : sequence of ScoreMeasure
        Score columns.
    title, preset : str
        Start of the caption, and name of the metrics preset in the caption.
    uncertainties : callable, optional
        Function that returns intervals and marks, which `meaning` explains. The ends of the
        intervals are in the data as `low` and `high`.
    skip_undefined : bool
        Average over the runs that have a score. By default the mean is missing if one is missing.
    """
    runs = complete(runs)
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    unit_of = runs.groupby(sequence)["unit"].first().tolist() if "unit" in runs else sequences
    unit, units = pd.factorize(np.array(unit_of))
    means = partial(_statistics, measures=measures, skip_undefined=skip_undefined)
    by_cell, _, sizes = means(runs, tracker * len(sequences) + sequence)
    cell_tracker = by_cell.index // len(sequences)
    cell_sequence = by_cell.index % len(sequences)
    by_unit, _, _ = means(by_cell, cell_tracker * len(units) + unit[cell_sequence])
    mean, _, _ = means(by_unit, by_unit.index // len(units))
    # The spread over repetitions is defined if all sequences have equally many.
    times = sizes.groupby(cell_tracker).agg(["min", "max"])
    repetition, repetitions = pd.factorize(runs["repetition"])
    by_pass, _, _ = means(runs, tracker * len(repetitions) + repetition)
    _, spread, _ = means(by_pass, by_pass.index // len(repetitions))
    spread = spread.where(times["min"] == times["max"])
    reasons = _missing_reasons(runs, tracker, measures)
    entries = _entries(reasons, mean, spread, mean * np.nan, measures)
    if uncertainties is not None:
        entries = _with_uncertainty(entries, by_unit, len(units), measures, uncertainties)
    caption = f"{title}: {means_over(sequences, len(units))}; metrics preset {preset}. {meaning}"
    labels = [{"tracker": name} for name in trackers]
    return _table("summary", caption, labels, entries, runs, measures, preset)


def means_over(sequences: Sequence[str], n_units: int) -> str:
    """Return the part of a caption that describes means over sequences or units."""
    names = ", ".join(sequences) if len(sequences) <= 4 else f"{len(sequences)} sequences"
    names += f" in {n_units} units" if n_units < len(sequences) else ""
    return f"means over {names}, each counting once"


def sequence_table(
    runs: pd.DataFrame, measures: Sequence[ScoreMeasure], title: str, preset: str
) -> Table:
    """Make a table of trackers by measures on every sequence; parameters as for `summary_table`.

    There are no marks: one sequence is one unit.
    """
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    cells = sequence * len(trackers) + tracker
    mean, spread, _ = _statistics(runs, cells, measures)
    reasons = _missing_reasons(runs, cells, measures)
    entries = _entries(reasons, mean, spread, mean, measures)
    labels = [
        {"sequence": sequences[cell // len(trackers)], "tracker": trackers[cell % len(trackers)]}
        for cell in mean.index
    ]
    caption = (
        f"{title}: every sequence; metrics preset {preset}. Means and ± standard deviations over "
        "repetitions."
    )
    return _table("sequences", caption, labels, entries, runs, measures, preset)


class _Entry(NamedTuple):
    """Mean of a measure; the fields are the columns of the data of a table."""

    mean: float = math.nan
    standard_deviation: float = math.nan  # over repetitions; NaN if a run is missing
    low: float = math.nan
    high: float = math.nan
    marked: bool = False
    out_of: float = math.nan
    runs: int = 0
    lacking: str = ""  # reason of a missing mean


def _table(
    name: str,
    caption: str,
    labels: Sequence[Mapping[str, str]],
    entries: Sequence[Sequence[_Entry]],
    runs: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
    preset: str,
) -> Table:
    """Return a table of entries; `labels`: labels of each row by heading."""
    rows = [
        [Cell(text) for text in label.values()]
        + [Cell(_cell_text(*pair), pair[0].marked) for pair in zip(row, measures, strict=True)]
        for label, row in zip(labels, entries, strict=True)
    ]
    data = [
        {**label, "preset": preset, "measure": measure.name, **entry._asdict()}
        for label, row in zip(labels, entries, strict=True)
        for measure, entry in zip(measures, row, strict=True)
    ]
    heads = [*(labels[0] if labels else ()), *(measure.head for measure in measures)]
    notes, ranks = notes_of(runs, measures[0].name), [measure.rank for measure in measures]
    n_labels = len(heads) - len(measures)
    return Table(name, caption, heads, n_labels, rows, notes, pd.DataFrame(data), ranks)


def _numbers(runs: pd.DataFrame) -> list[tuple[NDArray[np.int64], list[str]]]:
    """Return indices by row and names, in order of appearance, of trackers and sequences."""
    factors = [pd.factorize(runs[column]) for column in ("tracker", "sequence")]
    return [(index.astype(np.int64), [str(name) for name in names]) for index, names in factors]


def _statistics(
    runs: pd.DataFrame,
    groups: NDArray[np.int64] | pd.Index,
    measures: Sequence[ScoreMeasure],
    *,
    skip_undefined: bool = False,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.Series]:
    """Return means and standard deviations by group and column, and the groups' sizes.

    They are NaN if a value of the group is missing, unless `skip_undefined`.
    """
    columns = dict.fromkeys(name for m in measures for name in (m.name, m.out_of) if name in runs)
    grouped = runs[list(columns)].groupby(np.asarray(groups))
    sizes = grouped.size()
    whole = grouped.count().eq(sizes, axis=0) | skip_undefined
    return grouped.mean().where(whole), grouped.std().where(whole), sizes


def _missing_reasons(
    runs: pd.DataFrame, groups: NDArray[np.int64], measures: Sequence[ScoreMeasure]
) -> list[tuple[int, str]]:
    """Return number of runs and reason of a missing mean by group: `2 of 5 stale`, else empty.

    Failed runs count if they have a score by the first measure.
    """
    group_indices, sizes = np.unique(groups, return_counts=True)
    others = ~counted(runs, measures[0].name).to_numpy()
    kinds: dict[int, Counter[str]] = {}
    for group, status in zip(groups[others].tolist(), runs["status"][others], strict=True):
        kinds.setdefault(group, Counter())[status] += 1
    words = [
        f"{kinds[group].total()} of {size} {' or '.join(kinds[group])}" if group in kinds else ""
        for group, size in zip(group_indices.tolist(), sizes.tolist(), strict=True)
    ]
    return list(zip(sizes.tolist(), words, strict=True))


def _entries(
    reasons: list[tuple[int, str]],
    mean: pd.DataFrame,
    spread: pd.DataFrame,
    out_of: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
) -> list[list[_Entry]]:
    """Return the entries of a table, one row per group."""
    absent = pd.Series(math.nan, mean.index)
    columns = [
        [
            values.get(name, absent).tolist()
            for values, name in ((mean, m.name), (spread, m.name), (out_of, m.out_of))
        ]
        for m in measures
    ]
    return [
        [
            _Entry(runs=runs, lacking=why)
            if why
            else _Entry(means[row], spreads[row], runs=runs, out_of=totals[row])
            for means, spreads, totals in columns
        ]
        for row, (runs, why) in enumerate(reasons)
    ]


def _with_uncertainty(
    entries: list[list[_Entry]],
    by_unit: pd.DataFrame,
    n_units: int,
    measures: Sequence[ScoreMeasure],
    uncertainties: Uncertainties,
) -> list[list[_Entry]]:
    """Return entries with intervals and marks; missing means stay missing.

    `by_unit`: means of units, indexed by tracker * n_units + unit.
    """
    extended = [list(row) for row in entries]
    for column, measure in enumerate(measures):
        present = [i for i, row in enumerate(entries) if not np.isnan(row[column].mean)]
        if not present:
            continue
        places = [row * n_units + unit for row in present for unit in range(n_units)]
        values = by_unit[measure.name].reindex(places).to_numpy(np.float64)
        table = values.reshape(len(present), n_units)
        defined = ~np.isnan(table).all(axis=0)
        intervals, marks = uncertainties(table[:, defined], measure)
        for row, interval, marked in zip(present, intervals, marks, strict=True):
            low, high = interval or (math.nan, math.nan)
            entry = extended[row][column]._replace(low=low, high=high, marked=marked)
            extended[row][column] = entry
    return extended


def _cell_text(entry: _Entry, measure: ScoreMeasure) -> str:
    if entry.lacking:
        return f"{MISSING} ({entry.lacking})"
    if np.isnan(entry.mean):
        return MISSING
    if measure.never and entry.mean == entry.out_of:
        return measure.never
    spread = entry.standard_deviation
    is_count = bool(measure.out_of) and entry.mean.is_integer() and not spread > 0
    digits = 0 if is_count else measure.decimals
    mean, spread, low, high = (
        f"{value * measure.scale:.{digits}f}" for value in (entry.mean, spread, *entry[2:4])
    )
    text = f"{mean} [{low}, {high}]" if np.isfinite(entry.low) else mean
    if np.isfinite(entry.standard_deviation) and not np.isfinite(entry.low):
        text += f" ±{spread}"
    if np.isfinite(entry.out_of) and not measure.never:
        text += f" of {entry.out_of * measure.scale:.0f}"
    return text


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

    `worst`: score of a failed run; empty if failed runs have none. `every`: treatment of a tracker
    whose runs all failed.
    """
    notes = dict[str, str]()
    for tracker, rows in runs.groupby("tracker", sort=False, observed=True):
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


def notes_of(runs: pd.DataFrame, score: str) -> list[str]:
    """Return notes on failed and missing runs and malformed boxes by tracker.

    `score`: column in which counted failed runs have a value.
    """
    worst = "the worst score" if (counted(runs, score) & (runs["status"] == "failed")).any() else ""
    notes = [f"{tracker}: {note}" for tracker, note in failure_notes(runs, worst).items()]
    for status in ("missing", "stale", NOT_RUN):
        selected = runs[runs["status"] == status]
        counts = selected.groupby("tracker", sort=False, observed=True).size()
        notes += [
            f"{status}: {tracker}, {count} {_STATUS_MEANINGS[status]}"
            for tracker, count in counts.items()
        ]
    if "malformed" in runs:
        finished = runs[runs["status"] == "finished"]
        sums = finished.groupby("tracker", sort=False, observed=True)["malformed"].sum()
        notes += [
            f"malformed: {tracker}, {count:.0f} boxes not finite with a positive size: misses"
            for tracker, count in sums[sums > 0].items()
        ]
    return notes


def timed_by(runs: pd.DataFrame) -> str:
    """Return the prefix of the time columns by which trackers are compared; empty without times.

    It is `warm_seconds` if all timing runs have warm times, else `cpu_seconds`.
    """
    decoded, warm = (runs.get(f"{key}_seconds_median", pd.Series()) for key in ("cpu", "warm"))
    if decoded.isna().all():
        return ""
    return "warm_seconds" if warm.notna().sum() == decoded.notna().sum() else "cpu_seconds"


def text_columns(table: Table) -> list[bool]:
    """Return for each column whether it has texts: labels, or mostly cells without a number.

    Cells with several statements (`0 of 2; fragile`) are always texts.
    """
    are_texts = []
    for column in range(len(table.heads)):
        cells = [row[column].text for row in table.rows]
        filled = [text for text in cells if text not in ("", _NO_FRAME) and text[0] != MISSING]
        n_numbers = sum(_NUMBER.match(text) is not None for text in filled)
        has_statements = any(";" in text for text in filled)
        is_text = column < table.n_labels or has_statements or 2 * n_numbers < len(filled)
        are_texts.append(is_text)
    return are_texts
