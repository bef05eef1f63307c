"""Which rows of a table a side of a test means, under a reading of the text.

In a table of runs (one with a column `settled`) a side names a tracker. Its parameters are those
that are usual on the sequence, over them the reading's, over them the side's own; the runs whose
settled parameters are equal to these are meant, so that nothing depends on how they were written.
In other tables a side names columns, and a reading's parameters limit columns of their names.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.kinds import Limits, Side, Value, trackers_of
from bench.claims.readings import ANY, Axis, Option, Reading, Readings
from bench.experiments.contestant import contestant
from datasets.text_form import format_text
from trackers import TrackerError

__all__ = [
    "SETTLED",
    "Compared",
    "Table",
    "headline_rows",
    "light_rows",
    "limited",
    "rows_by_reading",
    "run_key",
]

Rows: TypeAlias = pd.DataFrame

SETTLED = "settled"
"""Column of what `run_key` gives, in tables of runs."""


@cache
def run_key(text: str) -> str:
    """What runs are matched by: a tracker's name, settled parameters and what it starts from.

    Raises
    ------
    TrackerError
        For a tracker, a preset or a parameter that is not known.
    """
    settled = contestant(text)
    return json.dumps([settled.name, settled.parameters, settled.init], sort_keys=True)


def limited(rows: pd.DataFrame, limits: Limits) -> pd.DataFrame:
    """Rows with one of the values that are let through, in every column."""
    for column, values in limits.items():
        rows = rows[rows[column].isin(values)]
    return rows


def light_rows(rows: Rows, columns: Collection[str]) -> Rows:
    """The same rows with these columns alone, quick to choose from many times.

    Texts are Python's own: choosing from Arrow's takes several times as long.
    """
    chosen = rows[[column for column in rows if column in columns]]
    texts = [column for column in chosen if isinstance(chosen[column].dtype, pd.StringDtype)]
    return chosen.astype(dict.fromkeys(texts, object)).copy()


class Table:
    """Scores, or another table, in which sides are looked up many times."""

    def __init__(self, rows: pd.DataFrame, readings: Readings) -> None:
        self.rows, self.readings = rows, readings
        self.is_of_runs = SETTLED in rows
        self._places: dict[object, list[int]] = {}
        if self.is_of_runs:
            for place, key in enumerate(zip(rows[SETTLED], rows["sequence"], strict=True)):
                self._places.setdefault(key, []).append(place)

    def key(self, tracker: str, parameters: Mapping[str, Value], sequence: str) -> str | None:
        """What a tracker's runs on a sequence are matched by; None where it has no such parameter.

        The parameters are laid over what is usual on the sequence.
        """
        usual = self.readings.usual.get(sequence, {}).get(tracker, {})
        return _known_key(format_text(tracker, {**usual, **parameters}))

    def parameters(self, tracker: str) -> list[str]:
        """Names of a tracker's parameters; of none that has no runs."""
        found = self.rows.loc[self.rows["tracker"] == tracker, SETTLED].head(1)
        return [key for one in found for key in json.loads(one)[1]]

    def has(self, keys: Iterable[tuple[object, str]]) -> bool:
        """Whether there are runs of any key on its sequence."""
        return any(key in self._places for key in keys)

    def places(self, keys: Iterable[tuple[object, str]]) -> list[int]:
        """Places of runs by key and sequence."""
        return sorted(place for key in keys for place in self._places.get(key, []))

    def of(self, keys: Iterable[tuple[object, str]]) -> Rows:
        """Runs by key and sequence."""
        return self.rows.iloc[self.places(keys)]

    def runs(self, tracker: str, parameters: Mapping[str, Value], sequences: Iterable[str]) -> Rows:
        """Runs of a tracker with these parameters, over what is usual on each sequence."""
        return self.of((self.key(tracker, parameters, one), one) for one in sequences)

    def index(
        self, tracker: str, parameters: Mapping[str, Value], sequences: Iterable[str]
    ) -> pd.Index:
        """Index of the same runs."""
        keys = ((self.key(tracker, parameters, one), one) for one in sequences)
        return self.rows.index[self.places(keys)]


class _Rows:
    """Rows before readings limit their columns."""

    def __init__(self, rows: Rows) -> None:
        self.rows = rows
        self.told = cache(self._told)
        self._right = cache(self._limited)

    def _told(self, column: str) -> NDArray[np.bool_] | None:
        """Which rows belong to one reading, as those of none belong to all; None for none."""
        if column not in self.rows:
            return None
        values = self.rows[column]
        told = ~(values.isna() | (values == ANY)).to_numpy(bool)
        return told if told.any() else None

    def _limited(self, column: str, values: tuple[Value, ...]) -> NDArray[np.bool_]:
        return self.rows[column].isin(values).to_numpy(bool)

    def has(self, limits: Limits) -> bool | None:
        """Whether there are rows of these; None where no row belongs to one reading."""
        found = [
            bool(self._right(column, tuple(values)).any())
            for column, values in limits.items()
            if self.told(column) is not None
        ]
        return all(found) if found else None

    def choose(self, limits: Limits) -> "Chosen":
        """Those of these, and those of no reading."""
        chosen, asked = np.ones(len(self.rows), bool), []
        for column, values in limits.items():
            if (told := self.told(column)) is not None:
                asked.append((column, *values))
                chosen &= self._right(column, tuple(values)) | ~told
        return Chosen(self.rows, chosen, tuple(asked))


@dataclass(frozen=True)
class Chosen:
    """Rows of a side under a reading, and what it asks: readings that ask the same are one."""

    among: Rows
    chosen: NDArray[np.bool_]
    asked: tuple[object, ...]

    @property
    def rows(self) -> Rows:
        """The rows that are compared."""
        return self.among[self.chosen]


class Compared:
    """A side of a test, whose rows are asked for under many readings.

    It is asked for on `sequences` (None: on whatever there is), and for rows within any of `where`.
    Columns that are `named` the test itself limits: they are no readings here. `any_will_do` says
    that runs of one of several trackers are enough.
    """

    def __init__(
        self,
        table: Table,
        side: Side,
        sequences: Sequence[str] | None = None,
        where: Sequence[Limits] = ({},),
        named: Collection[str] = (),
        *,
        any_will_do: bool = False,
    ) -> None:
        self._table, self._sequences, self._where = table, sequences, where
        self._any_will_do = any_will_do
        self._trackers, self._columns = trackers_of(side)
        self._is_of_runs = table.is_of_runs and bool(self._trackers)
        if self._trackers and not self._is_of_runs:
            self._columns = {**self._columns, "tracker": [name for name, _ in self._trackers]}
        self._named = {*named, *self._columns}
        self._base: dict[tuple[tuple[Value | None, ...], ...], _Rows] = {}

    def matters(self, axis: Axis) -> bool:
        """Whether an axis of readings could tell its rows apart."""
        if self._is_of_runs and any(
            one.of(name) or (one.shared and (name in axis.over or not axis.over))
            for name, _ in self._trackers
            for one in axis.options.values()
        ):
            return True
        limits = [self._limits(option) for option in axis.options.values()]
        return any(column in self._table.rows for each in limits for column in each)

    def has(self, option: Option) -> bool | None:
        """Whether it has rows that an option limits it to; None where the option limits none."""
        if not self._is_of_runs:
            return self._among(()).has(self._limits(option))
        if option.shared or any(option.of(name) for name, _ in self._trackers):
            return None  # which the parameters of other axes decide, too
        return self._every.has(self._limits(option))

    def choose(self, reading: Reading) -> Chosen:
        """Rows under a reading; see the module."""
        limits: Limits = {}
        for _, option in reading.options:
            limits |= self._limits(option)
        if not self._is_of_runs:
            return self._among(()).choose(limits)
        sequences = self._sequences or ()
        asked = [
            # Two presets that settle to the same are two readings of the text all the same.
            (told.get("preset"), *(self._table.key(name, told, one) for one in sequences))
            for name, own in self._trackers
            for told in [{**reading.parameters(name), **own}]
        ]
        found = self._among(tuple(asked)).choose(limits)
        return replace(found, asked=(*asked, *found.asked))

    def _limits(self, option: Option) -> Limits:
        limits = dict(option.where)
        if not self._is_of_runs:
            limits |= {key: [value] for key, value in option.shared.items()}
        return {key: values for key, values in limits.items() if key not in self._named}

    @cached_property
    def _every(self) -> _Rows:
        return _Rows(self._table.rows)

    @cached_property
    def _none(self) -> _Rows:
        """What most readings ask for: nothing was run so."""
        return _Rows(self._table.rows.iloc[:0])

    def _among(self, asked: tuple[tuple[Value | None, ...], ...]) -> _Rows:
        """Rows whatever columns of readings say."""
        if asked not in self._base:
            self._base[asked] = self._of_runs(asked) if self._is_of_runs else self._of_table()
        return self._base[asked]

    def _of_runs(self, asked: tuple[tuple[Value | None, ...], ...]) -> _Rows:
        sequences = self._sequences or ()
        wanted = [list(zip(keys, sequences, strict=True)) for _, *keys in asked]
        there = [keys for keys in wanted if self._table.has(keys)]
        if not there or (len(there) < len(wanted) and not self._any_will_do):
            return self._none
        pieces = [self._limited(self._table.of(keys)) for keys in there]
        complete = self._any_will_do or all(map(len, pieces))
        return _Rows(pd.concat(pieces)) if complete else self._none

    def _of_table(self) -> _Rows:
        rows = self._table.rows
        if self._sequences is not None:
            rows = rows[rows["sequence"].isin(list(self._sequences))]
        return _Rows(self._limited(rows))

    def _limited(self, rows: Rows) -> Rows:
        rows = limited(rows, self._columns)
        kept = [limited(rows, part).index for part in self._where]
        return rows[np.any([rows.index.isin(index) for index in kept], axis=0)]


Found = tuple[Reading, frozenset[tuple[str, ...]], list[Rows]]


def rows_by_reading(sides: Sequence[Compared], readings: Readings) -> Iterator[Found]:
    """Readings that ask for different rows; only those with rows for all sides.

    Of those that ask the same the first, all of them (see `Readings.places`), and rows of each
    side.
    """

    def has(option: Option) -> bool:
        known = [answer for side in sides if (answer := side.has(option)) is not None]
        return any(known) or not known

    found: dict[tuple[object, ...], tuple[Reading, list[tuple[str, ...]], list[Rows]]] = {}
    for reading in readings.all(lambda axis: any(side.matters(axis) for side in sides), has):
        chosen = [side.choose(reading) for side in sides]
        if all(one.chosen.any() for one in chosen):
            asked = tuple(one.asked for one in chosen)
            if asked not in found:
                found[asked] = reading, [], [one.rows for one in chosen]
            found[asked][1].append(readings.places(reading))
    for reading, same, rows in found.values():
        yield reading, frozenset(same), rows


def headline_rows(sides: Sequence[Compared], readings: Readings) -> Iterator[list[Rows]]:
    """Rows of each side under the headline reading; of rival ones one after the other."""
    first = {
        id(option)
        for axis in readings.axes.values()
        for place, option in enumerate(axis.options.values())
        if axis.rivals or not place
    }

    def matters(axis: Axis) -> bool:
        return any(side.matters(axis) for side in sides)

    for reading in readings.all(matters, lambda option: id(option) in first):
        yield [side.choose(reading).rows for side in sides]


@cache
def _known_key(text: str) -> str | None:
    """As `run_key`; None for what no tracker is: nothing was run that is so."""
    try:
        return run_key(text)
    except TrackerError:
        return None
