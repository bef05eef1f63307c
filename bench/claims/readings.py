"""Which rows of a table belong to a reading of the text."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product

import pandas as pd

from bench.claims.ledger import ANY, Readings

__all__ = ["readings_among", "rows_under"]

Named = Collection[str]
"""Columns that a test names itself: their values are what it compares, no reading."""


def readings_among(
    readings: Readings, tables: Sequence[pd.DataFrame], named: Named = ()
) -> Iterator[dict[str, str]]:
    """All readings that the tables can tell apart, the headline first.

    Parameters
    ----------
    readings : Readings
        Of a ledger.
    tables : sequence of DataFrame
        What a claim is judged by. A column that none of them has, or on which none of their rows
        depends, makes no reading, nor does a value that no row has.
    named : collection of str
        Columns that are no reading here.
    """
    columns = {}
    for column, values in readings.columns.items():
        found = (set(table[column].unique()) for table in tables if column in table)
        there = set[object]().union(*found) - {ANY}
        if there and column not in named:
            columns[column] = [value for value in values if value in there]
    for chosen in product(*columns.values()):
        yield dict(zip(columns, chosen, strict=True))


def rows_under(
    readings: Readings, table: pd.DataFrame, reading: Mapping[str, str], named: Named = ()
) -> pd.DataFrame:
    """Rows of a table under a reading, those of the headline where it says nothing.

    Rows that depend on no reading (`ANY`) belong to every one.
    """
    for column, values in readings.columns.items():
        if column in table and column not in named:
            table = table[table[column].isin([reading.get(column, values[0]), ANY])]
    return table
