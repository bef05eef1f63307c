"""Tables of scores: one model, which every renderer shows in its own way.

A mean is taken over repetitions first and over sequences then, so that each sequence counts
once. A run that is missing never disappears from a mean: the mean is shown as missing, with the
count of what is missing. A failed run has the worst score.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Direction: TypeAlias = Literal["higher", "lower"]

MISSING = "—"
NOT_RUN = "not run"
_WORDS = {
    "missing": "of the runs that were asked for",
    "stale": "by another version of the tracker or the sequence",
    NOT_RUN: "of the sequences",
}
_FRAME = re.compile(r"^(frame \d+|\S+\.(?:png|jpe?g|bmp|tiff?|webp|p[gp]m)): ", re.IGNORECASE)

_NEVER = "none"  # in place of the number of a frame
_NUMBER = re.compile(
    r"([\[(~<>≤≥]*\s*[+-]?\d*)(?:(?<=\d)\.?\d*|\.\d+)(?:e[+-]?\d+)?(?=$|[\s,;%\])±–*])",
    re.IGNORECASE | re.ASCII,
)


@dataclass(frozen=True)
class ScoreMeasure:
    """A score as tables show it: a column of theirs."""

    name: str  # column of the runs' data frame
    title: str  # head of the table's column
    unit: str = ""  # of what is shown; empty for pure numbers
    direction: Direction | None = None  # which value is better; None where neither is
    decimals: int = 2  # digits shown after the point
    scale: float = 1.0  # shown is the score times this (1000 shows seconds as milliseconds)
    out_of: str = ""  # column with the number that a count is out of; shown as `k of n`
    never: str = ""  # what is shown, instead of `n of n`, where the score is that number
    rank: int = 0  # a narrow page leaves out those of the highest rank first
    least: float = -math.inf  # that the score can be
    most: float = math.inf  # likewise
    margin: float = 0.0  # difference of scores that is irrelevant in practice

    @property
    def head(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True)
class Cell:
    """One entry of a table: its text, and whether it is marked by a star or bold."""

    text: str
    best: bool = False


@dataclass(frozen=True)
class Table:
    """A table before it has a format."""

    name: str  # of its file, without suffix
    caption: str  # what is shown, over what, by which metrics preset
    heads: list[str]  # of the columns
    n_labels: int  # how many columns, from the left, name the row
    rows: list[list[Cell]]
    notes: list[str] = field(default_factory=list)  # beneath it: failures, what is missing
    data: pd.DataFrame = field(default_factory=pd.DataFrame)  # at full precision, a row a value
    ranks: list[int] = field(default_factory=list)  # of the columns of scores, see `ScoreMeasure`


def text_table(
    name: str,
    caption: str,
    heads: Iterable[str],
    rows: list[list[str]],
    n_labels: int = 1,
    notes: Iterable[str] = (),
) -> Table:
    """Return a table of texts, which are its data, too."""
    cells = [[Cell(text) for text in row] for row in rows]
    data = pd.DataFrame(rows, columns=[*heads])
    return Table(name, caption, [*heads], n_labels, cells, [*notes], data)


def complete(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs with a `not run` row for every tracker and sequence that have none together.

    Means over other sequences than another tracker's would compare what can't be compared.
    """
    pairs = runs[["tracker", "sequence"]].drop_duplicates().astype(str)
    there = set(pairs.itertuples(index=False, name=None))
    lacking = [
        {"tracker": tracker, "sequence": sequence, "repetition": 0, "status": NOT_RUN}
        for tracker in pairs["tracker"].unique()
        for sequence in pairs["sequence"].unique()
        if (tracker, sequence) not in there
    ]
    return pd.concat([runs, pd.DataFrame(lacking)], ignore_index=True) if lacking else runs


class Uncertainty(NamedTuple):
    """Uncertainty of the means of a column, by tracker."""

    intervals: Sequence[tuple[float, float] | None]
    marks: Sequence[bool]


Uncertainties: TypeAlias = Callable[[NDArray[np.float64], ScoreMeasure], Uncertainty]
"""Computes it from a measure's values of shape (trackers, units)."""


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
        A row a run: `tracker`, `sequence`, `repetition`, `status` (`finished`, `failed`, or
        `missing`, `stale`, which give no mean), `failure`, a column a measure, and optionally
        `unit`: what is averaged over, the sequences by default. Failed runs count if they have a
        score.
    measures : sequence of ScoreMeasure
        The columns.
    title, preset : str
        Beginning of the caption, and the metrics preset that it names.
    uncertainties : callable, optional
        Intervals and marks, explained by `meaning`. Ends join the data as `low` and `high`.
    skip_undefined : bool
        Average over the runs that have a score. By default a mean needs those of all runs.
    """
    runs = complete(runs)
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    unit_of = runs.groupby(sequence)["unit"].first().tolist() if "unit" in runs else sequences
    unit, units = pd.factorize(np.array(unit_of))
    means = partial(_statistics, measures=measures, skip_undefined=skip_undefined)
    by_cell, _, sizes = means(runs, tracker * len(sequences) + sequence)
    own, of = by_cell.index // len(sequences), by_cell.index % len(sequences)
    by_unit, _, _ = means(by_cell, own * len(units) + unit[of])
    mean, _, _ = means(by_unit, by_unit.index // len(units))
    # The mean over sequences varies over repetitions if all sequences have as many.
    times = sizes.groupby(own).agg(["min", "max"])
    repetition, repetitions = pd.factorize(runs["repetition"])
    by_pass, _, _ = means(runs, tracker * len(repetitions) + repetition)
    _, spread, _ = means(by_pass, by_pass.index // len(repetitions))
    spread = spread.where(times["min"] == times["max"])
    entries = _entries(_lacking(runs, tracker, measures), mean, spread, mean * np.nan, measures)
    if uncertainties is not None:
        entries = _with_uncertainty(entries, by_unit, len(units), measures, uncertainties)
    return Table(
        name="summary",
        caption=f"{title}: {means_over(sequences, len(units))}; metrics preset {preset}. {meaning}",
        heads=["tracker", *(measure.head for measure in measures)],
        n_labels=1,
        rows=_rows([[tracker] for tracker in trackers], entries, measures),
        notes=notes_of(runs, measures[0].name),
        data=_tidy([{"tracker": name} for name in trackers], entries, measures, preset),
        ranks=[measure.rank for measure in measures],
    )


def means_over(sequences: Sequence[str], n_units: int) -> str:
    """Return the words of a caption for means over sequences, or over units of several."""
    names = ", ".join(sequences) if len(sequences) <= 4 else f"{len(sequences)} sequences"
    names += f" in {n_units} units" if n_units < len(sequences) else ""
    return f"means over {names}, each counting once"


def sequence_table(
    runs: pd.DataFrame, measures: Sequence[ScoreMeasure], title: str, preset: str
) -> Table:
    """Make a table of trackers by measures on every sequence; parameters as `summary_table`.

    Nothing is marked: one sequence is one unit.
    """
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    cells = sequence * len(trackers) + tracker
    mean, spread, _ = _statistics(runs, cells, measures)
    lacking = _lacking(runs, cells, measures)
    entries = _entries(lacking, mean, spread, mean, measures)
    labels = [
        [sequences[cell // len(trackers)], trackers[cell % len(trackers)]] for cell in mean.index
    ]
    named = [{"sequence": one, "tracker": of} for one, of in labels]
    return Table(
        name="sequences",
        caption=(
            f"{title}: every sequence; metrics preset {preset}. Means and ± standard deviations "
            "over repetitions."
        ),
        heads=["sequence", "tracker", *(measure.head for measure in measures)],
        n_labels=2,
        rows=_rows(labels, entries, measures),
        notes=notes_of(runs, measures[0].name),
        data=_tidy(named, entries, measures, preset),
        ranks=[measure.rank for measure in measures],
    )


@dataclass(frozen=True)
class _Entry:
    """A mean with its spread over repetitions; NaN where a run it needs is not there."""

    mean: float
    spread: float = float("nan")
    lacking: str = ""
    runs: int = 0
    out_of: float = float("nan")
    interval: tuple[float, float] | None = None
    marked: bool = False


def _numbers(runs: pd.DataFrame) -> list[tuple[NDArray[np.int64], list[str]]]:
    """Numbers of trackers and of sequences by row, and names in the order of appearance."""
    found = [pd.factorize(runs[column]) for column in ("tracker", "sequence")]
    return [(numbers.astype(np.int64), [str(name) for name in names]) for numbers, names in found]


def _statistics(
    runs: pd.DataFrame,
    groups: NDArray[np.int64] | pd.Index,
    measures: Sequence[ScoreMeasure],
    *,
    skip_undefined: bool = False,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.Series]:
    """Return means and standard deviations by group and column, and the groups' sizes.

    They are missing if a value of the group is missing, unless `skip_undefined`.
    """
    columns = dict.fromkeys(name for m in measures for name in (m.name, m.out_of) if name in runs)
    grouped = runs[list(columns)].groupby(np.asarray(groups))
    sizes = grouped.size()
    whole = grouped.count().eq(sizes, axis=0) | skip_undefined
    return grouped.mean().where(whole), grouped.std().where(whole), sizes


def _lacking(
    runs: pd.DataFrame, groups: NDArray[np.int64], measures: Sequence[ScoreMeasure]
) -> list[tuple[int, str]]:
    """Return the runs of each group, and why they have no mean: `2 of 5 stale`; '' if they have.

    Failed runs count if they have a score by the first measure.
    """
    known, sizes = np.unique(groups, return_counts=True)
    others = ~counted(runs, measures[0].name).to_numpy()
    kinds: dict[int, Counter[str]] = {}
    for group, status in zip(groups[others].tolist(), runs["status"][others], strict=True):
        kinds.setdefault(group, Counter())[status] += 1
    words = [
        f"{kinds[group].total()} of {size} {' or '.join(kinds[group])}" if group in kinds else ""
        for group, size in zip(known.tolist(), sizes.tolist(), strict=True)
    ]
    return list(zip(sizes.tolist(), words, strict=True))


def _entries(
    lacking: list[tuple[int, str]],
    mean: pd.DataFrame,
    spread: pd.DataFrame,
    out_of: pd.DataFrame,
    measures: Sequence[ScoreMeasure],
) -> list[list[_Entry]]:
    """A row a group."""
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
            _Entry(math.nan, lacking=why, runs=runs)
            if why
            else _Entry(means[row], spreads[row], runs=runs, out_of=totals[row])
            for means, spreads, totals in columns
        ]
        for row, (runs, why) in enumerate(lacking)
    ]


def _rows(
    labels: list[list[str]], entries: list[list[_Entry]], measures: Sequence[ScoreMeasure]
) -> list[list[Cell]]:
    return [
        [Cell(text) for text in names]
        + [
            Cell(_shown(entry, measure), entry.marked)
            for entry, measure in zip(row, measures, strict=True)
        ]
        for names, row in zip(labels, entries, strict=True)
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
    made = [list(row) for row in entries]
    for column, measure in enumerate(measures):
        present = [row for row, of in enumerate(entries) if not np.isnan(of[column].mean)]
        if not present:
            continue
        places = [row * n_units + unit for row in present for unit in range(n_units)]
        values = by_unit[measure.name].reindex(places).to_numpy(np.float64)
        table = values.reshape(len(present), n_units)
        defined = ~np.isnan(table).all(axis=0)
        intervals, marks = uncertainties(table[:, defined], measure)
        for row, interval, marked in zip(present, intervals, marks, strict=True):
            made[row][column] = replace(made[row][column], interval=interval, marked=marked)
    return made


def _shown(entry: _Entry, measure: ScoreMeasure) -> str:
    if entry.lacking:
        return f"{MISSING} ({entry.lacking})"
    if np.isnan(entry.mean):
        return MISSING
    if measure.never and entry.mean == entry.out_of:
        return measure.never
    counted = bool(measure.out_of) and entry.mean.is_integer() and not entry.spread > 0
    digits = 0 if counted else measure.decimals
    text = f"{entry.mean * measure.scale:.{digits}f}"
    if entry.interval is not None:
        low, high = (f"{end * measure.scale:.{digits}f}" for end in entry.interval)
        text += f" [{low}, {high}]"
    elif np.isfinite(entry.spread):
        text += f" ±{entry.spread * measure.scale:.{digits}f}"
    if np.isfinite(entry.out_of) and not measure.never:
        text += f" of {entry.out_of * measure.scale:.0f}"
    return text


def _tidy(
    labels: list[dict[str, str]],
    entries: list[list[_Entry]],
    measures: Sequence[ScoreMeasure],
    preset: str,
) -> pd.DataFrame:
    return pd.DataFrame(
        {
            **label,
            "preset": preset,
            "measure": measure.name,
            "mean": entry.mean,
            "standard_deviation": entry.spread,
            "low": entry.interval[0] if entry.interval else math.nan,
            "high": entry.interval[1] if entry.interval else math.nan,
            "marked": entry.marked,
            "out_of": entry.out_of,
            "runs": entry.runs,
            "lacking": entry.lacking,
        }
        for label, row in zip(labels, entries, strict=True)
        for measure, entry in zip(measures, row, strict=True)
    )


def counted(runs: pd.DataFrame, score: str) -> "pd.Series[bool]":
    """Return which runs a mean includes: finished ones, and failed ones that have the score."""
    finished = runs["status"] == "finished"
    if score not in runs:
        return finished
    return finished | ((runs["status"] == "failed") & runs[score].notna())


def failure_notes(
    runs: pd.DataFrame, worst: str = "the worst score", every: str = "left out"
) -> dict[str, str]:
    """Return, by tracker with failed runs, how many failed, and where and why the first one did.

    `worst`: score of a failed run; '' if failed runs have none. `every`: treatment of a tracker
    whose every run failed.
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
    """Return failures, missing and malformed runs by tracker.

    `score`: column that failed runs have a value in if they are counted.
    """
    worst = "the worst score" if (counted(runs, score) & (runs["status"] == "failed")).any() else ""
    notes = [f"{tracker}: {note}" for tracker, note in failure_notes(runs, worst).items()]
    for status in ("missing", "stale", NOT_RUN):
        here = runs[runs["status"] == status]
        counts = here.groupby("tracker", sort=False, observed=True).size()
        notes += [
            f"{status}: {tracker}, {count} {_WORDS[status]}" for tracker, count in counts.items()
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
    """Columns of times to compare by: warm where all that were timed have it, or as decoded.

    `warm_seconds` or `cpu_seconds`, which `_median` and the like follow; empty for none.
    """
    decoded, warm = (runs.get(f"{one}_seconds_median", pd.Series()) for one in ("cpu", "warm"))
    if decoded.isna().all():
        return ""
    return "warm_seconds" if warm.notna().sum() == decoded.notna().sum() else "cpu_seconds"


class Number(NamedTuple):
    """A text that begins with a number, in two parts: up to its units, and what follows them."""

    whole: str
    rest: str


def number_in(text: str) -> Number | None:
    """The parts of a text that begins with a number: `~3.1`, `[-0.2, 0.1]`, `54 of 99`.

    >>> number_in("0.784 ±0.204")
    Number(whole='0', rest='.784 ±0.204')
    """
    found = _NUMBER.match(text)
    return Number(found[1], text[found.end(1) :]) if found else None


def texts_of(table: Table) -> list[bool]:
    """Which columns have texts: labels, and those most of whose cells begin with no number.

    Cells with several statements (`0 of 2; fragile`) are texts, whatever they begin with.
    """
    found = []
    for column in range(len(table.heads)):
        cells = [row[column].text for row in table.rows]
        known = [text for text in cells if text not in ("", _NEVER) and text[0] != MISSING]
        numbers = sum(number_in(text) is not None for text in known)
        told = any(";" in text for text in known)
        found.append(column < table.n_labels or told or 2 * numbers < len(known))
    return found


def rests_of(table: Table) -> list[set[str]]:
    """Of each column of numbers what follows their units; empty where all are as long.

    So nothing need be done to such a column, and to one of texts, but to set it left or right.
    """
    found = []
    for column, text in enumerate(texts_of(table)):
        cells = [] if text else [number_in(row[column].text) for row in table.rows]
        rests = {one.rest for one in cells if one is not None}
        found.append(rests if len({*map(len, rests)}) > 1 else set())
    return found
