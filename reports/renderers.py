"""Renderers of tables: terminal, plain text, Markdown, CSV, JSON, HTML and LaTeX."""

import html
import json
import re
import textwrap
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import chain, groupby
from math import inf

import pandas as pd

from trackmark.reports.printable import one_line, width, wrap
from trackmark.reports.tables import MISSING, Cell, Table, text_columns

_LATEX = {sign: f"\\{sign}" for sign in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    # LaTeX prints other characters for the next three in its default encoding.
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "±": r"$\pm$",
    "µ": r"$\mu$",
    "—": "---",
    "…": r"\ldots{}",
    "–": "--",
    "×": r"$\times$",
    "²": "$^2$",
    "·": r"$\cdot$",
    "≤": r"$\leq$",
    "≥": r"$\geq$",
    "→": r"$\to$",
}

# Characters that pdfLaTeX cannot print; it stops at these.
_UNPRINTABLE = re.compile(
    "[^\x00-\x7fÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝßàáâãäåæçèéêëìíîïñòóôõöøùúûüýÿĆćČčĎďĚěĞğŁłŃńŇňŐőŒœŘřŚśŠšŤťŮůŰűŸŹźŻżŽž]"
)
_MIN_COLUMNS = 2  # columns of scores that a terminal never omits
_HEAD_WIDTH = 12  # width at which column headings are wrapped on a terminal
_FORMULA = re.compile("'*[=+@＝＋＠－-]")  # spreadsheets also accept the wide characters
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)


def to_csv(table: Table) -> str:
    """Render the data of a table as CSV: one unrounded value per row, missing values empty.

    A spreadsheet would evaluate a text that starts with `=`, `+`, `-` or `@`: such a text gets a
    leading apostrophe. A text with apostrophes before such a character gets one more, so that
    removing one restores the text. Numbers are unchanged.
    """
    values = _values(table).rename(columns=_to_csv_value).map(_to_csv_value)
    return values.to_csv(index=False, lineterminator="\n")


def _values(table: Table) -> pd.DataFrame:
    """Return the data of a table; a table without data has the texts of its cells."""
    if len(table.records) or not table.rows:
        return table.records
    headings = table.headings
    if len({*headings} - {""}) < len(headings):  # headings can be empty or equal
        headings = [f"{number} {heading}".strip() for number, heading in enumerate(headings, 1)]
    return pd.DataFrame([[cell.text for cell in row] for row in table.rows], columns=headings)


def to_json(table: Table) -> str:
    """Render the data of a table on one line of JSON: unrounded values, missing values null."""
    data = _values(table).astype(object)
    rows = data.where(data.notna() & ~data.isin([inf, -inf]), None).to_dict("records")
    content = {"table": table.name, "caption": table.caption, "notes": table.notes, "rows": rows}
    return json.dumps(content)


def to_markdown(table: Table) -> str:
    """Render a table as a pipe table in Markdown; marked cells are bold."""
    alignment = ["---" if text else "---:" for text in text_columns(table)]
    caption, *headings = map(in_markdown, [table.caption, *table.headings])
    rows = [headings, alignment, *_cells(table, in_markdown, "**{}**")]
    notes = [f"- {in_markdown(note)}" for note in table.notes]
    body = [f"| {' | '.join(row)} |" for row in rows] if table.rows else []
    lines = [caption, *([""] if body else []), *body]
    return "\n".join([*lines, *([""] if notes else []), *notes]) + "\n"


def to_latex(table: Table) -> str:
    r"""Render a table in LaTeX (needs `\usepackage{booktabs}`); marked cells are bold.

    Characters that pdfLaTeX cannot print are replaced by their numbers (`\u043a`).
    """
    caption, *notes = map(in_latex, [table.caption, *table.notes])
    if not table.rows:
        return "\n\n".join([caption, *notes]) + "\n"
    rows = [[*map(in_latex, table.headings)], *_cells(table, in_latex, r"\textbf{{{}}}")]
    # LaTeX would parse a bracket or an asterisk at the start of a row as an option.
    shields = ["{}" if row[0].startswith(("[", "*")) else "" for row in rows]
    pairs = zip(shields, rows, strict=True)
    headings, *body = (rf"{shield}{' & '.join(row)} \\" for shield, row in pairs)
    columns = "".join("l" if text else "r" for text in text_columns(table))
    lines = [
        r"\begin{table}[htbp]",
        r"\centering",
        rf"\caption{{{caption}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        headings,
        r"\midrule",
        *body,
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\footnotesize {note}" for note in notes),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def to_html(table: Table) -> str:
    """Render a table as an HTML element; marked cells are bold."""
    headings = "".join(f"<th>{_in_html(heading)}</th>" for heading in table.headings)
    rows = "".join(
        f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>"
        for row in _cells(table, _in_html, "<b>{}</b>")
    )
    notes = "".join(f"<p>{_in_html(note)}</p>" for note in table.notes)
    return (
        f"<table><caption>{_in_html(table.caption)}</caption><thead><tr>{headings}</tr></thead>"
        f"<tbody>{rows}</tbody></table>{notes}"
    )


def to_text(table: Table) -> str:
    """Render a table as aligned text; marked cells are followed by `*`.

    The only label of a row extends over the following columns.
    """
    caption, *notes = map(one_line, [table.caption, *table.notes])
    if not table.rows:
        return "\n".join([caption, *notes]) + "\n"
    alone = [not any(cell.text for cell in row[1:]) for row in table.rows]
    columns = [
        _column(heading, [row[column] for row in table.rows], alone, is_text=is_text)
        for column, (heading, is_text) in enumerate(
            zip(table.headings, text_columns(table), strict=True)
        )
    ]
    lines = max(map(len, columns))  # headings may take several lines
    padded = [[" " * _width(cells[0])] * (lines - len(cells)) + cells for cells in columns]
    body = ["  ".join(cells).rstrip() for cells in zip(*padded, strict=True)]
    return "\n".join([caption, "", *body, *notes]) + "\n"


def _column(heading: str, cells: list[Cell], alone: list[bool], *, is_text: bool) -> list[str]:
    """Return the lines of a column: heading, rule, cells.

    `alone`: True for cells that extend over the following columns.
    """
    no_mark = " " if any(cell.is_best for cell in cells) else ""
    lines = [one_line(cell.text) + ("*" if cell.is_best else no_mark) for cell in cells]
    widths = [_width(line) for line, over in zip(lines, alone, strict=True) if not over]
    folded = textwrap.wrap(one_line(heading), max(_HEAD_WIDTH, *widths), break_long_words=False)
    headings = [line if is_text else line + no_mark for line in folded or [""]]
    widest = max(*map(_width, headings), *widths, 0)
    all_lines = *headings, "-" * widest, *lines
    gaps = [" " * (widest - _width(line)) for line in all_lines]
    pairs = zip(all_lines, gaps, strict=True)
    return [line + gap if is_text else gap + line for line, gap in pairs]


def _width(line: str) -> int:
    """Return the number of terminal columns of a text."""
    return sum(
        0 if unicodedata.combining(sign) else 1 + (unicodedata.east_asian_width(sign) in "WF")
        for sign in line
    )


def _cells(table: Table, escaped: Callable[[str], str], bold: str) -> list[list[str]]:
    """Return the texts of the body, marked cells in bold."""
    return [
        [bold.format(escaped(cell.text)) if cell.is_best else escaped(cell.text) for cell in row]
        for row in table.rows
    ]


def _to_csv_value(value: object) -> object:
    """Return a number unchanged; protect a text from evaluation by a spreadsheet."""
    if not isinstance(value, str):
        return value
    line = one_line(value)
    return f"'{line}" if _FORMULA.match(line) and not _NUMBER.fullmatch(line) else line


def in_markdown(foreign: str) -> str:
    """Escape a text for Markdown."""
    # Brackets are escaped only if they could form a link: those around units stay readable.
    return re.sub(r"(^\[|[\\|*_`<~]|&(?=[#\w]+;)|\](?=[(\[]))", r"\\\1", one_line(foreign))


def _in_html(foreign: str) -> str:
    return html.escape(one_line(foreign))


def in_latex(foreign: str) -> str:
    """Escape a text for LaTeX."""
    escaped = "".join(_LATEX.get(sign, sign) for sign in one_line(foreign))
    return _UNPRINTABLE.sub(lambda sign: rf"\textbackslash{{}}u{ord(sign[0]):04x}", escaped)


FORMATS: Mapping[str, tuple[str, Callable[[Table], str]]] = {
    "text": (".txt", to_text),
    "markdown": (".md", to_markdown),
    "csv": (".csv", to_csv),
    "latex": (".tex", to_latex),
}
"""Suffix and renderer of each format of tables."""


def terminal_lines(table: Table, more: str = "", *, all_columns: bool = False) -> list[str]:
    """Return caption, rows and notes in lines of the terminal's `width` if possible.

    There is no rule between headings and rows. The reason of missing means is printed once per
    row. If the table is still too wide, the first of two labels gets separate lines if rows share
    it. Then columns are omitted, starting with the highest rank. `more`: advice on how to
    print them, for a note that names them; no note by default. If the labels alone take more than
    half of the width, they get separate lines. Columns that are still too wide, or all of them if
    `all_columns`, continue below the others.
    """
    shortened = narrow = replace(table, rows=list(map(_shorten_reasons, table.rows)))
    shared = len({row[0].text for row in table.rows}) < max(2, len(table.rows))
    may_group, grouped = table.n_labels == 2 and shared, False
    columns = list(range(len(table.headings)))
    order = sorted(range(len(table.ranks)), key=lambda column: (table.ranks[column], column))
    while _is_too_wide(narrow):
        if may_group and not grouped:
            grouped = True
        elif len(order) > _MIN_COLUMNS and not all_columns:
            columns.remove(order.pop() + table.n_labels)
        else:
            break
        narrow = _with_columns(shortened, columns, grouped=grouped)
    omitted = "; ".join(name for i, name in enumerate(table.headings) if i not in columns)
    notes = [*table.notes, *([f"Left out: {omitted} ({more})."] if omitted and more else [])]
    paragraphs = [wrap(one_line(text)).splitlines() for text in (table.caption, *notes)]
    if _is_too_wide(narrow) and not grouped and 2 * max(map(_width, _labels(table))) > width():
        narrow = _labels_above(shortened)
    tables = _side_by_side(narrow) if _is_too_wide(narrow) else [narrow]
    rows = [line for part in tables for line in _lines(part) if line.strip("- ")]
    return [*paragraphs[0], *rows, *chain(*paragraphs[1:])]


def _is_too_wide(table: Table) -> bool:
    return max(map(len, _lines(table)), default=0) > width()


def _labels(table: Table) -> list[str]:
    """Return the labels of each row in one text."""
    return ["  ".join(cell.text for cell in row[: table.n_labels]) for row in table.rows]


def _labels_above(table: Table) -> Table:
    """Return the table with the labels of each row on a line above its scores."""
    scores = table.headings[table.n_labels :]
    rows = []
    for labels, row in zip(_labels(table), table.rows, strict=True):
        rows.append([Cell(labels), *(Cell("") for _ in scores)])
        rows.append([Cell(""), *row[table.n_labels :]])
    return replace(table, headings=["", *scores], n_labels=1, rows=rows)


def _side_by_side(table: Table) -> list[Table]:
    """Return tables with the same rows that together have all columns, as many each as fit."""
    labels = list(range(table.n_labels))
    groups: list[list[int]] = [labels]
    for column in range(table.n_labels, len(table.headings)):
        if groups[-1] != labels and _is_too_wide(_with_columns(table, [*groups[-1], column])):
            groups.append(labels)
        groups[-1] = [*groups[-1], column]
    return [_with_columns(table, columns) for columns in groups]


def _lines(table: Table) -> list[str]:
    """Return the lines of a table as text without its caption and notes."""
    return to_text(replace(table, notes=[])).splitlines()[1:]


def _shorten_reasons(row: list[Cell]) -> list[Cell]:
    """Keep only the first of equal reasons for missing means in a row."""
    reasons: set[str] = set()
    cells = []
    for cell in row:
        is_repeated = cell.text.startswith(f"{MISSING} (") and cell.text in reasons
        cells.append(Cell(MISSING) if is_repeated else cell)
        reasons.add(cell.text)
    return cells


def _with_columns(table: Table, columns: list[int], *, grouped: bool = False) -> Table:
    """Return the table with some columns.

    `grouped`: each first label becomes a line of its own, above the rows that have it.
    """
    headings = [table.headings[column] for column in columns]
    rows = [[row[column] for column in columns] for row in table.rows]
    if not grouped:
        return replace(table, headings=headings, rows=rows)
    lines = []
    for label, block in groupby(rows, key=lambda row: row[0].text):
        lines.append([Cell(label), *(Cell("") for _ in headings[2:])])
        lines += [[Cell(f"  {row[1].text}"), *row[2:]] for row in block]
    return replace(table, headings=headings[1:], n_labels=1, rows=lines)
