"""A table in Markdown."""

from reports.tables import Table

__all__ = ["to_markdown"]


def to_markdown(table: Table) -> str:
    """Render a table in Markdown (pipe table); the best of a column is bold."""
    alignment = ["---" if column < table.n_labels else "---:" for column in range(len(table.heads))]
    rows = [
        [f"**{_escape(cell.text)}**" if cell.best else _escape(cell.text) for cell in row]
        for row in table.rows
    ]
    heads = [_escape(head) for head in table.heads]
    lines = [f"| {' | '.join(row)} |" for row in [heads, alignment, *rows]]
    notes = [f"- {_escape(note)}" for note in table.notes]
    return "\n".join([_escape(table.caption), "", *lines, *([""] if notes else []), *notes]) + "\n"


def _escape(text: str) -> str:
    for sign in "\\|*_`<":
        text = text.replace(sign, f"\\{sign}")
    return text
