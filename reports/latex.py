"""A table in LaTeX, with the rules of the package booktabs."""

from reports.tables import Table

__all__ = ["to_latex"]

_ESCAPES = {
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


def to_latex(table: Table) -> str:
    r"""Render a table in LaTeX (needs `\usepackage{booktabs}`); the best of a column is bold."""
    columns = "l" * table.n_labels + "r" * (len(table.heads) - table.n_labels)
    rows = [
        [rf"\textbf{{{_escape(cell.text)}}}" if cell.best else _escape(cell.text) for cell in row]
        for row in table.rows
    ]
    notes = [rf"\par\footnotesize {_escape(note)}" for note in table.notes]
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{_escape(table.caption)}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        " & ".join(_escape(head) for head in table.heads) + r" \\",
        r"\midrule",
        *(" & ".join(row) + r" \\" for row in rows),
        r"\bottomrule",
        r"\end{tabular}",
        *notes,
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _escape(text: str) -> str:
    return "".join(_ESCAPES.get(sign, sign) for sign in text)
