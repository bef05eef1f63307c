"""Runs by columns: text as numbers into lists of names, and a cell as one number.

A few bytes a run instead of a few hundred: what lists runs must bear millions of them.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.store.layout import folder_name, run_path

TEXT = pa.dictionary(pa.int32(), pa.string())
"""Type of a column of text."""

CELL = ("tracker", "sequence", "protocol", "repetition")
"""Columns that tell runs of an experiment apart."""

PLACE = ("tracker_folder", "sequence_folder", "repetition")
"""Columns that tell files of runs apart."""


def as_columns(arrays: Mapping[str, NDArray[Any]]) -> pa.Table:
    """A table of numbers and flags, one column an array.

    `pyarrow.table` gives the same but imports pandas to look at the arrays, which is a quarter of
    the time that it takes to begin a process in which trackers run.
    """
    return pa.table({name: _column(np.ascontiguousarray(arrays[name])) for name in arrays})


def _column(values: NDArray[Any]) -> pa.Array:
    flags = values.dtype == np.bool_
    stored = pa.py_buffer(np.packbits(values, bitorder="little") if flags else values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, stored])


def coded(names: Sequence[str] | pa.StringArray, numbers: ArrayLike) -> pa.DictionaryArray:
    """A column of text from the names and their number in each row."""
    return pa.DictionaryArray.from_arrays(
        pa.array(np.asarray(numbers, np.int32)), pa.array(names, pa.string())
    )


def codes(*columns: pa.ChunkedArray) -> tuple[pa.StringArray, list[NDArray[np.int32]]]:
    """The names in columns of text, and their numbers in the rows of each."""
    chunks = [chunk for column in columns for chunk in column.chunks]
    if not chunks:
        return pa.array([], pa.string()), [np.empty(0, np.int32) for _ in columns]
    whole = pa.chunked_array(chunks, TEXT).unify_dictionaries()
    numbers = np.concatenate([chunk.indices.to_numpy() for chunk in whole.chunks])
    bounds = np.cumsum([len(column) for column in columns])[:-1]
    return whole.chunk(0).dictionary, np.split(numbers, bounds)


def tidy(table: pa.Table) -> pa.Table:
    """The table with those names alone that its text uses, sorted: equal rows, equal tables."""
    for position, field in enumerate(table.schema):
        if field.type == TEXT:
            names, (numbers,) = codes(table[field.name])
            used = np.flatnonzero(np.bincount(numbers, minlength=len(names)))
            order = np.array(sorted(used.tolist(), key=names.to_pylist().__getitem__), np.int64)
            rank = np.zeros(len(names), np.int32)
            rank[order] = np.arange(len(order))
            column = coded(names.take(pa.array(order)), rank[numbers])
            table = table.set_column(position, field.name, column)
    return table


def numbered(tables: Sequence[pa.Table], columns: Iterable[str]) -> list[NDArray[np.int64]]:
    """A number for every row, the same wherever the columns say the same.

    `tables`: which hold the columns. `columns`: of text or whole numbers from 0.

    Gives them by table, of shape (n,).
    """
    numbers = [np.zeros(len(table), np.int64) for table in tables]
    for name in columns:
        found = [table[name] for table in tables]
        if found[0].type == TEXT:
            names, values = codes(*found)
            size = len(names)
        else:
            values = [column.to_numpy() for column in found]
            size = 1 + max((int(array.max()) for array in values if len(array)), default=0)
        for whole, array in zip(numbers, values, strict=True):
            whole *= max(size, 1)
            whole += array
    return numbers


def places(wanted: NDArray[np.int64], among: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where each of some numbers stands among others, of which no two are equal; -1 for nowhere."""
    if not len(among):
        return np.full(len(wanted), -1)
    order = np.argsort(among)
    place = order[np.searchsorted(among, wanted, sorter=order).clip(max=len(among) - 1)]
    return np.where(among[place] == wanted, place, -1)


def with_place(table: pa.Table) -> pa.Table:
    """The table with the columns `PLACE`: where the runs of its cells lie."""
    trackers, (tracker,) = codes(table["tracker"])
    protocols, (protocol,) = codes(table["protocol"])
    sequences, (sequence,) = codes(table["sequence"])
    pairs, pair = np.unique(numbered([table], ("tracker", "protocol"))[0], return_inverse=True)
    first = np.zeros(len(pairs), np.int64)
    first[pair] = np.arange(len(table))  # a row of each pair
    folders = [
        run_path(trackers[int(tracker[row])].as_py(), "", 0, protocols[int(protocol[row])].as_py())
        for row in first
    ]
    return table.append_column(
        "tracker_folder", coded([folder.parts[0] for folder in folders], pair)
    ).append_column(
        "sequence_folder", coded([folder_name(name) for name in sequences.to_pylist()], sequence)
    )
