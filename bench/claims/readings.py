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
        What a claim is judged by; a column that none of them has makes no reading.
    named : collection of str
        Columns that are no reading here.
    """
    columns = [
        column
        for column in readings.columns
        if column not in named and any(column in table for table in tables)
    ]
    for values in product(*(readings.columns[column] for column in columns)):
        yield dict(zip(columns, values, strict=True))


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
