"""Tables for a terminal: the most important columns that fit its width."""

from dataclasses import replace
from itertools import groupby

from trackmark.reports.printable import one_line, width, wrap
from trackmark.reports.renderers import to_text
from trackmark.reports.tables import MISSING, Cell, Table

_MIN_COLUMNS = 2  # columns of scores that are never omitted


def on_terminal(table: Table, more: str = "") -> str:
    """Render a table in the width of a terminal if possible.

    `more`: advice on how to print the omitted columns.
    """
    narrow, left_out = _fit_to_terminal(table)
    notes = [one_line(note) for note in narrow.notes]
    notes += [f"Left out: {'; '.join(left_out)}{more}."] if left_out else []
    caption, _, body = to_text(replace(narrow, notes=[])).partition("\n")
    return f"{wrap(caption)}\n{body}" + "".join(f"{wrap(note)}\n" for note in notes)


def terminal_lines(table: Table) -> list[str]:
    """Return caption, rows and notes in lines of the terminal's width if possible.

    Columns that do not fit are omitted. There is no rule between heads and rows.
    """
    narrow, _ = _fit_to_terminal(table)
    rows = [line for line in _lines(narrow) if line.strip("- ")]
    texts = [table.caption, *map(one_line, table.notes)]
    caption, *notes = [wrap(text).splitlines() for text in texts]
    return [*caption, *rows, *(line for note in notes for line in note)]


def _lines(table: Table) -> list[str]:
    """Return the lines of a table as text without its caption and notes."""
    return to_text(replace(table, notes=[])).splitlines()[1:]


def _fit_to_terminal(table: Table) -> tuple[Table, list[str]]:
    """Return the table in the `width` of a terminal, and the heads of omitted columns.

    The reason of missing means is printed once per row. If the table is still too wide, the first
    of two labels gets separate lines if rows share it. Then columns are omitted, starting with the
    highest rank.
    """
    shortened = narrow = replace(table, rows=list(map(_shorten_reasons, table.rows)))
    shared = len({row[0].text for row in table.rows}) < max(2, len(table.rows))
    may_group, grouped = table.n_labels == 2 and shared, False
    left_out: list[int] = []
    order = sorted(range(len(table.ranks)), key=lambda column: (table.ranks[column], column))
    while max(map(len, _lines(narrow)), default=0) > width():
        if may_group and not grouped:
            grouped = True
        elif len(order) > _MIN_COLUMNS:
            left_out.append(order.pop() + table.n_labels)
        else:
            break
        narrow = _without_columns(shortened, left_out, grouped=grouped)
    return narrow, [table.heads[i] for i in sorted(left_out)]


def _shorten_reasons(row: list[Cell]) -> list[Cell]:
    """Keep only the first of equal reasons for missing means in a row."""
    texts: set[str] = set()
    cells = []
    for cell in row:
        is_repeated = cell.text.startswith(f"{MISSING} (") and cell.text in texts
        cells.append(Cell(MISSING) if is_repeated else cell)
        texts.add(cell.text)
    return cells


def _without_columns(table: Table, left_out: list[int], *, grouped: bool) -> Table:
    """Return the table without some columns; `grouped`: first labels get separate lines."""
    columns = [column for column in range(len(table.heads)) if column not in left_out]
    heads = [table.heads[column] for column in columns]
    rows = [[row[column] for column in columns] for row in table.rows]
    if not grouped:
        return replace(table, heads=heads, rows=rows)
    lines = []
    for label, block in groupby(rows, key=lambda row: row[0].text):
        lines.append([Cell(label), *(Cell("") for _ in heads[2:])])
        lines += [[Cell(f"  {row[1].text}"), *row[2:]] for row in block]
    return replace(table, heads=heads[1:], n_labels=1, rows=lines)
