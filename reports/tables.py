"""Tables of scores: one model, which every renderer shows in its own way.

A mean is taken over repetitions first and over sequences then, so that each sequence counts
once. A run that is missing or failed never disappears from a mean: the mean is shown as
missing, with the count of what is missing.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reports.notes import NOT_RUN, notes_of

__all__ = [
    "MISSING",
    "Cell",
    "Direction",
    "Doubt",
    "Doubts",
    "Measure",
    "Table",
    "complete",
    "sequence_table",
    "summary_table",
]

Direction: TypeAlias = Literal["higher", "lower"]

MISSING = "—"


@dataclass(frozen=True)
class Measure:
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
    margin: float = 0.0  # difference of scores that means nothing in practice

    @property
    def head(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True)
class Cell:
    """One entry of a table: its text, and whether it is the best of its column (ties all are)."""

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
    ranks: list[int] = field(default_factory=list)  # of the columns of scores, see `Measure`


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


class Doubt(NamedTuple):
    """How sure the means of a column are, by tracker; NaN where nothing tells."""

    halves: Sequence[float]  # half the width of each mean's interval
    contenders: Sequence[bool]  # whether the data can't tell it from the best


Doubts: TypeAlias = Callable[[Sequence[Sequence[NDArray[np.float64]]], Measure], Doubt]
"""Finds it from a measure's values of the repetitions, by tracker and sequence."""


def summary_table(
    runs: pd.DataFrame,
    measures: Sequence[Measure],
    title: str,
    preset: str,
    doubts: Doubts | None = None,
    meaning: str = "standard deviation over repetitions",
) -> Table:
    """Trackers by measures, averaged over the sequences.

    Parameters
    ----------
    runs : DataFrame
        A row a run: `tracker`, `sequence`, `repetition`, `status` (`finished`; or `failed`,
        `missing`, `stale`, which a mean can't be taken over), `failure`, and a column a
        measure.
    measures : sequence of Measure
        The columns.
    title, preset : str
        What the caption begins with, and the metrics preset that it names.
    doubts : callable, optional
        What stands behind ± (ends of that interval, as far as the measure goes, join the data as
        `low` and `high`; shown where its range ends it), and whom the data can't tell from the
        best; the best mean is marked and ± is a standard deviation over repetitions by default.
    meaning : str
        Of ±, for the caption.
    """
    runs = complete(runs)
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    by_cell, _, sizes = _statistics(runs, tracker * len(sequences) + sequence, measures)
    mean, _, _ = _statistics(by_cell, by_cell.index // len(sequences), measures)
    # Over repetitions: the spread of the mean over sequences. Where sequences were
    # repeated unequally often (trackers that never draw run once), there is none to tell.
    times = sizes.groupby(sizes.index // len(sequences)).agg(["min", "max"])
    repeated = times["min"] == times["max"]
    repetition, repetitions = pd.factorize(runs["repetition"])
    by_pass, _, _ = _statistics(runs, tracker * len(repetitions) + repetition, measures)
    _, spread, _ = _statistics(by_pass, by_pass.index // len(repetitions), measures)
    entries = _entries(
        _lacking(runs, tracker), mean, spread.where(repeated), mean * np.nan, measures
    )
    rows = _rows([[tracker] for tracker in trackers], entries, measures)
    data = _tidy([{"tracker": tracker} for tracker in trackers], entries, measures, preset)
    if doubts is not None:
        rows, ends = _doubted(runs, (tracker, sequence), rows, entries, measures, doubts)
        data = data.assign(low=ends[:, 0], high=ends[:, 1])
        if any(" [" in cell.text for row in rows for cell in row[1:]):
            meaning += "; [from, to]: such an interval that the score's range ends"
    names = ", ".join(sequences) if len(sequences) <= 4 else f"{len(sequences)} sequences"
    over = f"{title}: means over {names}, each counting once; metrics preset {preset}."
    return Table(
        name="summary",
        caption=f"{over} ± {meaning}.",
        heads=["tracker", *(measure.head for measure in measures)],
        n_labels=1,
        rows=rows,
        notes=notes_of(runs),
        data=data,
        ranks=[measure.rank for measure in measures],
    )


def sequence_table(
    runs: pd.DataFrame, measures: Sequence[Measure], title: str, preset: str
) -> Table:
    """Trackers by measures on every single sequence; parameters as `summary_table`.

    The best of a column is marked among the trackers of one sequence.
    """
    (tracker, trackers), (sequence, sequences) = _numbers(runs)
    cells = sequence * len(trackers) + tracker
    mean, spread, _ = _statistics(runs, cells, measures)
    lacking = _lacking(runs, cells)
    entries = _entries(lacking, mean, spread, mean, measures)
    labels = [
        [sequences[cell // len(trackers)], trackers[cell % len(trackers)]] for cell in mean.index
    ]
    named = [{"sequence": one, "tracker": of} for one, of in labels]
    rows: list[list[Cell]] = []
    for _, block in groupby(range(len(labels)), key=lambda row: labels[row][0]):
        here = list(block)
        rows += _rows([labels[row] for row in here], [entries[row] for row in here], measures)
    return Table(
        name="sequences",
        caption=(
            f"{title}: every sequence; metrics preset {preset}. Means and ± standard deviations "
            "over repetitions."
        ),
        heads=["sequence", "tracker", *(measure.head for measure in measures)],
        n_labels=2,
        rows=rows,
        notes=notes_of(runs),
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
    ends: tuple[float, float] | None = None  # of an interval that ± would say wrongly


def _numbers(runs: pd.DataFrame) -> list[tuple[NDArray[np.int64], list[str]]]:
    """Numbers of trackers and of sequences by row, and names in the order of appearance."""
    found = [pd.factorize(runs[column]) for column in ("tracker", "sequence")]
    return [(numbers.astype(np.int64), [str(name) for name in names]) for numbers, names in found]


def _statistics(
    runs: pd.DataFrame, groups: NDArray[np.int64] | pd.Index, measures: Sequence[Measure]
) -> tuple[pd.DataFrame, pd.DataFrame, pd.Series]:
    """Means and standard deviations by group and column, and the groups' sizes.

    A missing value is not passed over: what would need it is missing.
    """
    columns = dict.fromkeys(name for m in measures for name in (m.name, m.out_of) if name in runs)
    grouped = runs[list(columns)].groupby(np.asarray(groups))
    sizes = grouped.size()
    whole = grouped.count().eq(sizes, axis=0)
    return grouped.mean().where(whole), grouped.std().where(whole), sizes


def _lacking(runs: pd.DataFrame, groups: NDArray[np.int64]) -> list[tuple[int, str]]:
    """Runs of each group, and why no mean can be taken: `2 of 5 failed`; empty where one can."""
    known, sizes = np.unique(groups, return_counts=True)
    others = (runs["status"] != "finished").to_numpy()
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
    measures: Sequence[Measure],
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
    labels: list[list[str]], entries: list[list[_Entry]], measures: Sequence[Measure]
) -> list[list[Cell]]:
    best = [
        _best([row[column].mean for row in entries], measure)
        for column, measure in enumerate(measures)
    ]
    return [
        [Cell(text) for text in names]
        + [
            Cell(_shown(entry, measure), _equals(entry.mean, best[column]))
            for column, (entry, measure) in enumerate(zip(row, measures, strict=True))
        ]
        for names, row in zip(labels, entries, strict=True)
    ]


def _doubted(
    runs: pd.DataFrame,
    numbers: tuple[NDArray[np.int64], NDArray[np.int64]],
    rows: list[list[Cell]],
    entries: list[list[_Entry]],
    measures: Sequence[Measure],
    doubts: Doubts,
) -> tuple[list[list[Cell]], NDArray[np.float64]]:
    """Rows of a summary, and ends of intervals, (cells, 2); missing means stay missing."""
    tracker, sequence = numbers
    cells = [
        [np.flatnonzero((tracker == row) & (sequence == one)) for one in np.unique(sequence)]
        for row in range(len(rows))
    ]
    made = [list(row) for row in rows]
    ends = np.full((len(rows), len(measures), 2), np.nan)
    for column, measure in enumerate(measures):
        known = [row for row, found in enumerate(entries) if np.isfinite(found[column].mean)]
        if not known or measure.name not in runs:
            continue
        values = runs[measure.name].to_numpy(np.float64)
        repeated = [[values[places] for places in cells[row]] for row in known]
        doubt = doubts(repeated, measure)
        for row, half, contender in zip(known, doubt.halves, doubt.contenders, strict=True):
            mean = entries[row][column].mean
            low, high = max(mean - half, measure.least), min(mean + half, measure.most)
            whole = not (mean - half < measure.least or mean + half > measure.most)
            entry = replace(entries[row][column], spread=half, ends=None if whole else (low, high))
            made[row][column + 1] = Cell(_shown(entry, measure), contender)
            ends[row, column] = (low, high) if np.isfinite(half) else np.nan
    return made, ends.reshape(-1, 2)


def _best(means: Iterable[float], measure: Measure) -> float | None:
    """The best mean as it is; None where there is no choice or no better."""
    known = [mean for mean in means if np.isfinite(mean)]
    if measure.direction is None or len(known) < 2:
        return None
    return max(known) if measure.direction == "higher" else min(known)


def _equals(mean: float, best: float | None) -> bool:
    """Whether a mean ties with the best: the order of a sum changes its last digits."""
    return best is not None and math.isclose(mean, best, rel_tol=1e-9, abs_tol=1e-12)


def _shown(entry: _Entry, measure: Measure) -> str:
    if entry.lacking:
        return f"{MISSING} ({entry.lacking})"
    if np.isnan(entry.mean):
        return MISSING
    if measure.never and entry.mean == entry.out_of:
        return measure.never
    counted = bool(measure.out_of) and entry.mean.is_integer() and not entry.spread > 0
    digits = 0 if counted else measure.decimals
    text = f"{entry.mean * measure.scale:.{digits}f}"
    if entry.ends is not None:
        low, high = (f"{end * measure.scale:.{digits}f}" for end in entry.ends)
        text += f" [{low}, {high}]"
    elif np.isfinite(entry.spread):
        text += f" ±{entry.spread * measure.scale:.{digits}f}"
    if np.isfinite(entry.out_of) and not measure.never:
        text += f" of {entry.out_of * measure.scale:.0f}"
    return text


def _tidy(
    labels: list[dict[str, str]],
    entries: list[list[_Entry]],
    measures: Sequence[Measure],
    preset: str,
) -> pd.DataFrame:
    return pd.DataFrame(
        {
            **label,
            "preset": preset,
            "measure": measure.name,
            "mean": entry.mean,
            "standard_deviation": entry.spread,
            "out_of": entry.out_of,
            "runs": entry.runs,
            "lacking": entry.lacking,
        }
        for label, row in zip(labels, entries, strict=True)
        for measure, entry in zip(measures, row, strict=True)
    )
