"""What was ever asked for: a report knows by it what is missing.

It is kept as JSON: the names of trackers, sequences, protocols and versions, and for every
series of repetitions, in the order in which they were asked for, the numbers of its names, its
first repetition and how many there are.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark.bench.store.checksum import PLACEHOLDER, check, sealed
from trackmark.bench.store.columns import CELL, PLACE, TEXT, coded, codes, numbered, with_place
from trackmark.bench.store.files import ResultsError, locked, unreadable, write_atomically
from trackmark.bench.store.layout import SCHEMA, Cell, check_schema

_NAMED = ("tracker", "sequence", "protocol", "version")
_TYPES = pa.schema([*((name, TEXT) for name in _NAMED), ("repetition", pa.int32())])
_FILE = "plan.json"


class Cells(Mapping[Cell, str]):
    """Versions by cell, in order; some twenty bytes a cell.

    `table`: `tracker`, `sequence`, `protocol`, `version` and `repetition`; no cell twice.
    """

    def __init__(self, table: pa.Table) -> None:
        self.table = table.select(_TYPES.names).cast(_TYPES)

    @classmethod
    def of(cls, versions: Mapping[Cell, str]) -> "Cells":
        """The same as any mapping of versions by cell."""
        if isinstance(versions, Cells):
            return versions
        rows = [(t, s, p, version, r) for (t, s, r, p), version in versions.items()]
        columns = zip(*rows, strict=True) if rows else [()] * len(_TYPES)
        return cls(
            pa.table(
                [pa.array(c, f.type) for c, f in zip(columns, _TYPES, strict=True)], schema=_TYPES
            )
        )

    def __len__(self) -> int:
        return len(self.table)

    def __iter__(self) -> Iterator[Cell]:
        names = ("tracker", "sequence", "repetition", "protocol")
        for batch in self.table.select(names).to_batches(max_chunksize=1 << 16):
            yield from zip(*(column.to_pylist() for column in batch.columns), strict=True)

    def __getitem__(self, cell: Cell) -> str:
        version: str = self.table["version"][self._places[cell]].as_py()
        return version

    @cached_property
    def _places(self) -> dict[Cell, int]:
        """For looking up single cells; many are looked up by columns."""
        return {cell: place for place, cell in enumerate(self)}


@dataclass(frozen=True)
class Asked:
    """What an experiment was asked for."""

    title: str  # headline of its report
    # The version (`Identity.version`) that was asked for last, by cell; made of any mapping.
    cells: Mapping[Cell, str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", Cells.of(self.cells))

    @property
    def table(self) -> pa.Table:
        """The cells by columns; see `Cells`."""
        assert isinstance(self.cells, Cells)  # see `__post_init__`
        return self.cells.table

    def and_then(self, later: "Asked") -> "Asked":
        """What was asked for, with what is asked for later; the later version of a series counts.

        A series is what a tracker is asked for on a sequence: all its repetitions have one
        version.
        """
        both = pa.concat_tables([self.table, later.table]).unify_dictionaries().combine_chunks()
        # The last of a series says the version of all, the first of a cell its place.
        series = numbered([both], CELL[:-1])[0][::-1]
        _, last, of_series = np.unique(series, return_index=True, return_inverse=True)
        names, (versions,) = codes(both["version"])
        both = both.set_column(
            both.schema.get_field_index("version"),
            "version",
            coded(names, versions[::-1][last][of_series[::-1]]),
        )
        _, first = np.unique(numbered([both], CELL)[0], return_index=True)
        return Asked(later.title or self.title, Cells(both.take(np.sort(first))))

    def only(self, kept: NDArray[np.bool_]) -> "Asked":
        """Those cells alone that are marked; shape (n,)."""
        return Asked(self.title, Cells(self.table.filter(pa.array(kept))))


def read_asked(folder: Path) -> Asked:
    """What was asked for so far; empty for a new folder.

    Raises `ResultsError` where the file is damaged or has another layout.
    """
    file = folder / _FILE
    if not file.is_file():
        return Asked("", {})
    try:
        content = file.read_bytes()
    except OSError as error:
        raise unreadable(file, error) from error
    try:
        plan = json.loads(content)
        check_schema(file, plan["schema"])
        check(file, content)
        return Asked(plan["title"], _cells(plan["names"], plan["series"]))
    except (ValueError, KeyError, TypeError, IndexError) as error:
        if isinstance(error, ResultsError):
            raise
        raise ResultsError(
            f"{file} is damaged ({type(error).__name__}: {error}). Remove it and run again."
        ) from None


def add_asked(folder: Path, asked: Asked) -> None:
    """Add to what was asked for so far."""
    with locked(folder):
        _write(folder, read_asked(folder).and_then(asked))


def withdraw(folder: Path, paths: Collection[str]) -> None:
    """Take back what was asked for, by the paths of runs relative to the folder."""
    places = [path.removesuffix(".parquet").rsplit("/", 2) for path in paths]
    gone = pa.table(
        {
            "tracker_folder": pa.array([place[0] for place in places], TEXT),
            "sequence_folder": pa.array([place[1] for place in places], TEXT),
            "repetition": pa.array([int(place[2]) for place in places], pa.int32()),
        }
    )
    with locked(folder):
        asked = read_asked(folder)
        there, removed = numbered([with_place(asked.table), gone], PLACE)
        _write(folder, asked.only(~np.isin(there, removed)))


def _write(folder: Path, asked: Asked) -> None:
    plan = {"schema": str(SCHEMA), "seal": json.dumps(PLACEHOLDER)}
    plan |= {"title": json.dumps(asked.title), **_series(asked.table)}
    content = sealed(_object(plan).encode())
    file = folder / _FILE
    if not file.is_file() or file.read_bytes() != content:
        write_atomically(file, content)


def _series(table: pa.Table) -> dict[str, str]:
    """Names, and the series of repetitions that follow one another, as JSON."""
    numbers = {name: codes(table[name]) for name in _NAMED}
    repetition = table["repetition"].to_numpy()
    begins = np.ones(len(table), bool)
    begins[1:] = np.diff(repetition) != 1
    for _, (values,) in numbers.values():
        begins[1:] |= np.diff(values) != 0
    first = np.flatnonzero(begins)
    names: dict[str, str] = {}
    series: dict[str, str] = {}
    # Column by column: all at once would need a Python object for every number.
    for name, (known, (values,)) in numbers.items():
        used, of_series = np.unique(values[first], return_inverse=True)
        names[name] = json.dumps(known.take(pa.array(used)).to_pylist())
        series[name] = json.dumps(of_series.tolist())
    series["first"] = json.dumps(repetition[first].tolist())
    series["count"] = json.dumps(np.diff(np.append(first, len(table))).tolist())
    return {"names": _object(names), "series": _object(series)}


def _object(fields: Mapping[str, str]) -> str:
    """A JSON object of fields that are JSON already."""
    return "{" + ",\n".join(f'"{key}": {value}' for key, value in fields.items()) + "}"


def _cells(names: Mapping[str, list[str]], series: Mapping[str, list[int]]) -> Cells:
    columns = {name: np.array(values, np.int64) for name, values in series.items()}
    first, count = columns["first"], columns["count"]
    if len({len(column) for column in columns.values()}) > 1 or (count < 1).any():
        raise ValueError("its series do not fit together")
    ends = np.cumsum(count)
    table = {}
    for name in _NAMED:
        if ((columns[name] < 0) | (columns[name] >= len(names[name]))).any():
            raise ValueError(f"a series has no {name}")
        table[name] = coded(names[name], np.repeat(columns[name], count))
    steps = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - count, count)
    table["repetition"] = pa.array((np.repeat(first, count) + steps).astype(np.int32))
    return Cells(pa.table(table))
