"""A table as plain text, aligned for a terminal."""

import unicodedata

from reports.tables import Table

__all__ = ["to_text"]


def to_text(table: Table) -> str:
    """Render a table as aligned text; the best of a column is followed by `*`."""
    body = [[f"{cell.text}{'*' if cell.best else ' '}" for cell in row] for row in table.rows]
    for row in body:
        for column in range(table.n_labels):
            row[column] = row[column].rstrip()
    heads = [
        head if column < table.n_labels else f"{head} " for column, head in enumerate(table.heads)
    ]
    widths = [max(_width(row[column]) for row in [heads, *body]) for column in range(len(heads))]

    def line(row: list[str]) -> str:
        cells = [
            _pad(text, width, left=column < table.n_labels)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        return "  ".join(cells).rstrip()

    rule = "  ".join("-" * width for width in widths)
    lines = [table.caption, "", line(heads), rule, *map(line, body), *table.notes]
    return "\n".join(lines) + "\n"


def _width(text: str) -> int:
    """Columns that a text takes on a terminal."""
    return sum(
        0 if unicodedata.combining(sign) else 1 + (unicodedata.east_asian_width(sign) in "WF")
        for sign in text
    )


def _pad(text: str, width: int, *, left: bool) -> str:
    gap = " " * (width - _width(text))
    return text + gap if left else gap + text
