"""A table as comma-separated values for machines: a row a value, at full precision."""

from reports.tables import Table

__all__ = ["to_csv"]


def to_csv(table: Table) -> str:
    """Render a table's data as CSV; what is missing is an empty field."""
    return table.data.to_csv(index=False, lineterminator="\n")
