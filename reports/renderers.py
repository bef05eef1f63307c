"""What a table looks like: as plain text, Markdown, CSV and LaTeX."""

import html
import json
import re
import unicodedata
from collections.abc import Callable, Mapping
from math import isfinite

from reports.printable import one_line
from reports.tables import Table

__all__ = [
    "FORMATS",
    "in_markdown",
    "to_csv",
    "to_html",
    "to_json",
    "to_latex",
    "to_markdown",
    "to_text",
]

_LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    # The next three would be set as other signs in LaTeX's default encoding.
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

# What pdfLaTeX sets as it comes; for any other sign it would stop.
_BEYOND = re.compile(
    "[^\x00-\x7fÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝßàáâãäåæçèéêëìíîïñòóôõöøùúûüýÿĆćČčĎďĚěĞğŁłŃńŇňŐőŒœŘřŚśŠšŤťŮůŰűŸŹźŻżŽž]+"
)
OR_NUMBERS = r"\providecommand{\ornumbers}[2]{\ifdefined\Umathcode#1\else\texttt{#2}\fi}"

_FORMULA = re.compile("'*[=+@＝＋＠－-]")  # the wide ones count as such in some languages
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)


def to_csv(table: Table) -> str:
    """Render a table's data for machines: a row a value, at full precision, gaps left empty.

    A spreadsheet would compute a text that begins with `=`, `+`, `-` or `@`: it gets an apostrophe
    before it, as one types it there (and so does what begins with apostrophes and such a sign, so
    that taking one away gives the text). Numbers are left alone.
    """
    return table.data.map(_in_csv).to_csv(index=False, lineterminator="\n")


def to_json(table: Table) -> str:
    """Render a table's data on one line of JSON: at full precision, what is missing null."""
    rows = [
        {
            key: None if isinstance(value, float) and not isfinite(value) else value
            for key, value in row.items()
        }
        for row in table.data.to_dict("records")
    ]
    told = {"table": table.name, "caption": table.caption, "notes": table.notes, "rows": rows}
    return json.dumps(told)


def to_markdown(table: Table) -> str:
    """Render a table in Markdown (pipe table); the best of a column is bold."""
    alignment = ["---" if column < table.n_labels else "---:" for column in range(len(table.heads))]
    caption, *heads = map(in_markdown, [table.caption, *table.heads])
    rows = [heads, alignment, *_cells(table, in_markdown, "**{}**")]
    notes = [f"- {in_markdown(note)}" for note in table.notes]
    lines = [caption, "", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join([*lines, *([""] if notes else []), *notes]) + "\n"


def to_latex(table: Table) -> str:
    r"""Render a table in LaTeX (needs `\usepackage{booktabs}`); the best of a column is bold.

    Letters that pdfLaTeX can't set are shown by their numbers (`\u043a`); XeLaTeX and LuaLaTeX set
    them.
    """
    columns = "l" * table.n_labels + "r" * (len(table.heads) - table.n_labels)
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{in_latex(table.caption)}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        _latex_row(list(map(in_latex, table.heads))),
        r"\midrule",
        *map(_latex_row, _cells(table, in_latex, r"\textbf{{{}}}")),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\footnotesize {in_latex(note)}" for note in table.notes),
        r"\end{table}",
    ]
    if any(r"\ornumbers" in line for line in lines):
        lines.insert(0, OR_NUMBERS)
    return "\n".join(lines) + "\n"


def to_html(table: Table) -> str:
    """Render a table as a piece of HTML; the best of a column is bold."""
    heads = "".join(f"<th>{_in_html(head)}</th>" for head in table.heads)
    rows = "".join(
        f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>"
        for row in _cells(table, _in_html, "<b>{}</b>")
    )
    notes = "".join(f"<p>{_in_html(note)}</p>" for note in table.notes)
    return (
        f"<table><caption>{_in_html(table.caption)}</caption><thead><tr>{heads}</tr></thead>"
        f"<tbody>{rows}</tbody></table>{notes}"
    )


def to_text(table: Table) -> str:
    """Render a table as aligned text; the best of a column is followed by `*`."""
    body = [
        [f"{one_line(cell.text)}{'*' if cell.best else ' '}" for cell in row] for row in table.rows
    ]
    for row in body:
        for column in range(table.n_labels):
            row[column] = row[column].rstrip()
    heads = [
        head if column < table.n_labels else f"{head} "
        for column, head in enumerate(map(one_line, table.heads))
    ]
    widths = [max(_width(row[column]) for row in [heads, *body]) for column in range(len(heads))]

    def line(row: list[str]) -> str:
        cells = [
            _pad(text, width, left=column < table.n_labels)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        return "  ".join(cells).rstrip()

    rule = "  ".join("-" * width for width in widths)
    caption, *notes = map(one_line, [table.caption, *table.notes])
    lines = [caption, "", line(heads), rule, *map(line, body), *notes]
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


def _cells(table: Table, escaped: Callable[[str], str], bold: str) -> list[list[str]]:
    """The body's texts, the best of a column in bold."""
    return [
        [bold.format(escaped(cell.text)) if cell.best else escaped(cell.text) for cell in row]
        for row in table.rows
    ]


def _in_csv(value: object) -> object:
    """A number as it is; a text so that it is data for a spreadsheet, too."""
    if not isinstance(value, str):
        return value
    text = one_line(value)
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def in_markdown(text: str) -> str:
    """Text as Markdown shows it, in a cell or elsewhere on a line."""
    # No link without what begins a line or follows a bracket: those of units are left to be read.
    return re.sub(r"(^\[|[\\|*_`<~]|&(?=[#\w]+;)|\](?=[(\[]))", r"\\\1", one_line(text))


def _in_html(text: str) -> str:
    return html.escape(one_line(text))


def in_latex(text: str) -> str:
    r"""Text as LaTeX sets it; where it has `\ornumbers`, `OR_NUMBERS` stands before it."""
    escaped = "".join(_LATEX.get(sign, sign) for sign in one_line(text))
    return _BEYOND.sub(_or_numbers, escaped)


def _or_numbers(found: re.Match[str]) -> str:
    """Signs for those that can set them, and their numbers for pdfLaTeX."""
    numbers = "".join(rf"\textbackslash u{ord(sign):04x}" for sign in found[0])
    return rf"\ornumbers{{{found[0]}}}{{{numbers}}}"


def _latex_row(cells: list[str]) -> str:
    r"""Join cells to a row; after `\\` LaTeX would take a bracket or an asterisk for an option."""
    shield = "{}" if cells[0].startswith(("[", "*")) else ""
    return shield + " & ".join(cells) + r" \\"


FORMATS: Mapping[str, tuple[str, Callable[[Table], str]]] = {
    "text": (".txt", to_text),
    "markdown": (".md", to_markdown),
    "csv": (".csv", to_csv),
    "latex": (".tex", to_latex),
}
"""Suffix and renderer of every format that a table can have."""
