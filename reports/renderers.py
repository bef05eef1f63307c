"""What a table looks like: as plain text, Markdown, CSV and LaTeX."""

import unicodedata
from collections.abc import Callable, Mapping

from reports.tables import Table

__all__ = ["FORMATS", "to_csv", "to_latex", "to_markdown", "to_text"]

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
}


def to_csv(table: Table) -> str:
    """Render a table's data for machines: a row a value, at full precision, gaps left empty."""
    return table.data.to_csv(index=False, lineterminator="\n")


def to_markdown(table: Table) -> str:
    """Render a table in Markdown (pipe table); the best of a column is bold."""
    alignment = ["---" if column < table.n_labels else "---:" for column in range(len(table.heads))]
    caption, *heads = map(_in_markdown, [table.caption, *table.heads])
    rows = [heads, alignment, *_cells(table, _in_markdown, "**{}**")]
    notes = [f"- {_in_markdown(note)}" for note in table.notes]
    lines = [caption, "", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join([*lines, *([""] if notes else []), *notes]) + "\n"


def to_latex(table: Table) -> str:
    r"""Render a table in LaTeX (needs `\usepackage{booktabs}`); the best of a column is bold."""
    columns = "l" * table.n_labels + "r" * (len(table.heads) - table.n_labels)
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{_in_latex(table.caption)}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        " & ".join(map(_in_latex, table.heads)) + r" \\",
        r"\midrule",
        *(" & ".join(row) + r" \\" for row in _cells(table, _in_latex, r"\textbf{{{}}}")),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\footnotesize {_in_latex(note)}" for note in table.notes),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


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


def _cells(table: Table, escaped: Callable[[str], str], bold: str) -> list[list[str]]:
    """The body's texts, the best of a column in bold."""
    return [
        [bold.format(escaped(cell.text)) if cell.best else escaped(cell.text) for cell in row]
        for row in table.rows
    ]


def _in_markdown(text: str) -> str:
    for sign in "\\|*_`<":
        text = text.replace(sign, f"\\{sign}")
    return text


def _in_latex(text: str) -> str:
    return "".join(_LATEX.get(sign, sign) for sign in text)


FORMATS: Mapping[str, tuple[str, Callable[[Table], str]]] = {
    "text": (".txt", to_text),
    "markdown": (".md", to_markdown),
    "csv": (".csv", to_csv),
    "latex": (".tex", to_latex),
}
"""Suffix and renderer of every format that a table can have."""
