"""The index while runs are being made."""

import time
from typing import Any

import pyarrow as pa

from bench.store.index import BATCH, index_table, read_table, with_rows, write_index
from bench.store.results import Results

__all__ = ["GrowingIndex"]

_LEAST_SECONDS = 5.0
_PATIENCE = 50.0


class GrowingIndex:
    """An index that is written now and then; that takes about a fiftieth of the time at most.

    What is not written yet when a command is killed is found by the next reader, on disk.

    Parameters
    ----------
    results : Results
        Of the experiment.
    """

    def __init__(self, results: Results) -> None:
        self._results = results
        self._table = read_table(results)
        self._tables: list[pa.Table] = []
        self._rows: list[dict[str, Any]] = []
        self._due = time.monotonic() + _LEAST_SECONDS

    def add(self, rows: list[dict[str, Any]]) -> None:
        """Add rows as `index_row` makes them; their runs lie on disk."""
        self._rows += rows
        if len(self._rows) >= BATCH:
            self._pack()
        if time.monotonic() > self._due:
            self.write()

    def write(self) -> None:
        """Write it, if it has grown.

        Raises
        ------
        ResultsError
            Where it can't be written.
        """
        self._pack()
        if not self._tables:
            return
        began = time.monotonic()
        self._table = with_rows(self._table, self._tables)
        self._tables = []
        write_index(self._results, self._table)
        now = time.monotonic()
        self._due = now + max(_LEAST_SECONDS, _PATIENCE * (now - began))

    def _pack(self) -> None:
        """As objects rows are large."""
        if self._rows:
            self._tables.append(index_table(self._rows))
            self._rows = []
