"""A table for a terminal: no wider than that, with what its reader needs first."""

from collections.abc import Callable
from dataclasses import replace
from itertools import groupby

from trackmark.reports.printable import one_line, width, wrapped
from trackmark.reports.tables import MISSING, Cell, Table

_FEWEST = 2  # columns of scores that are shown however wide they are


def on_terminal(table: Table, render: Callable[[Table], str], more: str = "") -> str:
    """Render a table no wider than a terminal, where that can be.

    `render`: gives it as text, its caption in the first line. `more`: says how to see the columns
    that are left out.
    """
    narrow, left_out = fitted(table, lambda one: _columns(render(replace(one, notes=[]))))
    caption, _, body = render(replace(narrow, notes=[])).partition("\n")
    notes = [one_line(note) for note in narrow.notes]
    notes += [f"Left out: {'; '.join(left_out)}{more}."] if left_out else []
    return f"{wrapped(caption)}\n{body}" + "".join(f"{wrapped(note)}\n" for note in notes)


def _columns(text: str) -> int:
    """Of a table as text without its caption."""
    return max(map(len, text.splitlines()[1:]), default=0)


def fitted(table: Table, columns: Callable[[Table], int]) -> tuple[Table, list[str]]:
    """The table in the `width` of a terminal, and the heads of columns left out for that.

    Why a mean is missing is said once a row. Then the first of two labels gets lines of its own,
    where rows share it (a single one does), and columns go, those of the highest rank first.
    """
    made = replace(table, rows=list(map(_said_once, table.rows)), notes=list(table.notes))
    grouped = False
    shared = len({row[0].text for row in table.rows}) < max(2, len(table.rows))
    left_out: list[int] = []
    order = sorted(range(len(table.ranks)), key=lambda column: (table.ranks[column], column))
    while columns(_shown(made, left_out, grouped=grouped)) > width():
        if table.n_labels == 2 and shared and not grouped:
            grouped = True
        elif len(order) > _FEWEST:
            left_out.append(order.pop() + table.n_labels)
        else:
            break
    return _shown(made, left_out, grouped=grouped), [table.heads[i] for i in sorted(left_out)]


def _said_once(row: list[Cell]) -> list[Cell]:
    """The row with the reason that it has no scores in its first score alone."""
    seen: set[str] = set()
    said = []
    for cell in row:
        again = cell.text.startswith(f"{MISSING} (") and cell.text in seen
        said.append(Cell(MISSING) if again else cell)
        seen.add(cell.text)
    return said


def _shown(table: Table, left_out: list[int], *, grouped: bool) -> Table:
    """The table without some columns; grouped, its first labels stand in lines of their own."""
    kept = [column for column in range(len(table.heads)) if column not in left_out]
    heads = [table.heads[column] for column in kept]
    rows = [[row[column] for column in kept] for row in table.rows]
    if not grouped:
        return replace(table, heads=heads, rows=rows)
    lines = []
    for label, block in groupby(rows, key=lambda row: row[0].text):
        lines.append([Cell(label), *(Cell("") for _ in heads[2:])])
        lines += [[Cell(f"  {row[1].text}"), *row[2:]] for row in block]
    return replace(table, heads=heads[1:], n_labels=1, rows=lines)
