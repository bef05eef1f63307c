"""What a table looks like: as plain text, Markdown, CSV and LaTeX."""

import html
import json
import re
import textwrap
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from math import isfinite

from trackmark.reports.printable import one_line
from trackmark.reports.tables import Cell, Table, number_in, rests_of, texts_of

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
# Lines may end before each number; robust, since captions are written into files.
OR_NUMBERS = (
    r"\let\shownslash\textbackslash"
    "\n"
    r"\DeclareRobustCommand{\ornumbers}[2]{\ifdefined\Umathcode#1\else"
    r"{\def\textbackslash{\allowbreak\shownslash}\texttt{#2}}\fi}"
)

TO_FIT = (
    r"\providecommand{\tofit}[1]{\ifdefined\resizebox"
    r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{#1}\else#1\fi}"
)
"""What is wider than a page is scaled down to it, where graphicx is used."""

_HEAD = 12  # columns of a terminal that a head takes before it goes on in another line
_LINE = 76  # letters of a line in `article`, in the size of footnotes
_LONG = 24  # letters from which on texts of a column are wrapped
_LEAST = 12  # letters that a wrapped column has room for
_MOST_LINES = 36  # of a table's body on a page
_BETWEEN = 3  # letters that there would be room for between two columns
_MOST_NOTES = 900  # letters of notes beneath a table; more of them follow it
_WORD = re.compile(r"\S{13,}")
_CUT = re.compile(r"[A-Za-z]{18,}|(?=\w*\d)\w{13,}|[/:=,_.;-]+(?=\w)")
"""Where lines may end within words that are longer than a column: after signs, and in between."""

_FORMULA = re.compile("'*[=+@＝＋＠－-]")  # the wide ones count as such in some languages
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)


def to_csv(table: Table) -> str:
    """Render a table's data for machines: a row a value, at full precision, gaps left empty.

    A spreadsheet would compute a text that begins with `=`, `+`, `-` or `@`: it gets an apostrophe
    before it, as one types it there (and so does what begins with apostrophes and such a sign, so
    that taking one away gives the text). Numbers are left alone.
    """
    named = table.data.rename(columns=_in_csv)
    return named.map(_in_csv).to_csv(index=False, lineterminator="\n")


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
    alignment = ["---" if text else "---:" for text in texts_of(table)]
    caption, *heads = map(in_markdown, [table.caption, *table.heads])
    rows = [heads, alignment, *_cells(table, in_markdown, "**{}**")]
    notes = [f"- {in_markdown(note)}" for note in table.notes]
    shown = [f"| {' | '.join(row)} |" for row in rows] if table.rows else []
    lines = [caption, *([""] if shown else []), *shown]
    return "\n".join([*lines, *([""] if notes else []), *notes]) + "\n"


def to_latex(table: Table) -> str:
    r"""Render a table in LaTeX (needs `\usepackage{booktabs}`); the best of a column is bold.

    Long texts are wrapped, and what is wider than a line all the same is scaled down to it (with
    graphicx); what is longer than a page is several tables. Letters that pdfLaTeX can't set are
    shown by their numbers (`\u043a`); XeLaTeX and LuaLaTeX set them.
    """
    if not table.rows:
        told = [breakable(in_latex(text)) for text in (table.caption, *table.notes)]
        return "\n\n".join(told) + "\n"
    room = _rooms(table)
    parted = list(map(bool, rests_of(table)))
    columns = "".join(
        f"p{{{letters / _LINE:.3f}\\linewidth}}"
        if letters
        else "l"
        if text
        else "r@{}l"
        if two
        else "r"
        for letters, text, two in zip(room, texts_of(table), parted, strict=True)
    )
    heads = _latex_row(_wrapped(_parted(map(Cell, table.heads), parted), room))
    shown = [_wrapped(_parted(row, parted), room) for row in table.rows]
    notes = [rf"\par\footnotesize {breakable(in_latex(note))}" for note in table.notes]
    follow = sum(map(len, table.notes)) > _MOST_NOTES
    pieces = _pieces(table, room)
    small = r"\footnotesize" if any(room) else ""
    lines = [TO_FIT]
    for number, piece in enumerate(pieces):
        more = " (continued)" if number else ""
        lines += [
            r"\begin{table}[htbp]",
            r"\centering",
            rf"\caption{{{breakable(in_latex(table.caption))}{more}}}",
            rf"{small}\tofit{{\begin{{tabular}}{{{columns}}}",
            r"\toprule",
            heads,
            r"\midrule",
            *(_latex_row(shown[row]) for row in piece),
            r"\bottomrule",
            r"\end{tabular}}",
            *(notes if piece is pieces[-1] and not follow else []),
            r"\end{table}",
        ]
    lines += ["{", *notes, r"\par}"] if follow else []
    if any(r"\ornumbers" in line for line in lines):
        lines.insert(0, OR_NUMBERS)
    return "\n".join(lines) + "\n"


def _parted(row: Iterable[Cell], parted: list[bool]) -> list[str]:
    """Cells as LaTeX sets them; numbers of parted columns in two, so that units are aligned."""
    cells = []
    for cell, two in zip(row, parted, strict=True):
        number = number_in(cell.text) if two else None
        parts = [in_latex(part) for part in number or [cell.text]]
        parts[1:] = [re.sub("^ ", "~", part) for part in parts[1:]]  # TeX would drop the space
        shown = [rf"\textbf{{{part}}}" if cell.best and part else part for part in parts]
        alone = two and number is None
        cells.append(rf"\multicolumn{{2}}{{r}}{{{shown[0]}}}" if alone else " & ".join(shown))
    return cells


def _rooms(table: Table) -> list[int]:
    """Letters that there is room for in columns that are wrapped; 0 for others."""
    texts = texts_of(table)
    widest = [
        max((_set(row[column].text) for row in table.rows), default=0)
        for column in range(len(table.heads))
    ]
    wide = [text and width > _LONG for text, width in zip(texts, widest, strict=True)]
    others = [
        max(width, _set(head)) + _BETWEEN
        for width, head, wrapped in zip(widest, table.heads, wide, strict=True)
        if not wrapped
    ]
    left = max(_LINE - sum(others) - _BETWEEN * sum(wide), _LEAST * sum(wide))
    weights = [
        min(width, 400) ** 0.5 if wrapped else 0.0
        for width, wrapped in zip(widest, wide, strict=True)
    ]
    return [max(_LEAST, int(left * weight / sum(weights))) if weight else 0 for weight in weights]


def _set(text: str) -> int:
    """Letters that a text takes, of which those beyond pdfLaTeX's are shown by their numbers."""
    return len(_BEYOND.sub(lambda found: "-" * 6 * len(found[0]), text))


def _pieces(table: Table, room: list[int]) -> list[list[int]]:
    """Numbers of rows that stand on a page together; one piece where there are none."""
    pieces: list[list[int]] = [[]]
    lines = 0
    for number, row in enumerate(table.rows):
        high = max(
            (
                -(-_set(cell.text) // letters)
                for cell, letters in zip(row, room, strict=True)
                if letters
            ),
            default=1,
        )
        if pieces[-1] and lines + high > _MOST_LINES:
            pieces.append([])
            lines = 0
        pieces[-1].append(number)
        lines += high
    return pieces


def _wrapped(cells: list[str], room: list[int]) -> list[str]:
    r"""Cells whose lines end anywhere, and are not stretched; `\raggedright` would take `\\`."""
    return [
        rf"\rightskip0pt plus1fil\hspace{{0pt}}{breakable(cell)}" if letters else cell
        for cell, letters in zip(cells, room, strict=True)
    ]


def breakable(latex: str) -> str:
    """LaTeX whose long words, names and digests say, may be divided between lines."""
    return _WORD.sub(lambda word: _CUT.sub(_divided, word[0]), latex)


def _divided(found: re.Match[str]) -> str:
    word = found[0]
    if not word[0].isalnum():
        return word + r"\allowbreak{}"
    mark = r"\-" if word.isalpha() else r"\allowbreak{}"
    return mark.join(word[start : start + 8] for start in range(0, len(word), 8))


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
    """Render a table as aligned text; the best of a column is followed by `*`.

    A label that stands alone in its row runs over the columns beside it.
    """
    caption, *notes = map(one_line, [table.caption, *table.notes])
    if not table.rows:
        return "\n".join([caption, *notes]) + "\n"
    alone = [not any(cell.text for cell in row[1:]) for row in table.rows]
    columns = [
        _column(head, [row[column] for row in table.rows], alone, text=text)
        for column, (head, text) in enumerate(zip(table.heads, texts_of(table), strict=True))
    ]
    lines = max(map(len, columns))  # heads may take several
    whole = [[" " * _width(cells[0])] * (lines - len(cells)) + cells for cells in columns]
    shown = ["  ".join(cells).rstrip() for cells in zip(*whole, strict=True)]
    return "\n".join([caption, "", *shown, *notes]) + "\n"


def _column(head: str, cells: list[Cell], alone: list[bool], *, text: bool) -> list[str]:
    """Lines of a column: of its head, a rule, its cells; numbers with their units aligned.

    `alone`: which cells run over the columns beside it.
    """
    beside = " " if any(cell.best for cell in cells) else ""
    shown = [one_line(cell.text) + ("*" if cell.best else beside) for cell in cells]
    if not text:
        numbers = list(map(number_in, shown))
        whole, rest = (
            max((_width(one[part]) for one in numbers if one), default=0) for part in (0, 1)
        )
        shown = [
            _pad(one.whole, whole, left=False) + _pad(one.rest, rest, left=True) if one else cell
            for one, cell in zip(numbers, shown, strict=True)
        ]
    widths = [_width(one) for one, over in zip(shown, alone, strict=True) if not over]
    folded = textwrap.wrap(one_line(head), max(_HEAD, *widths), break_long_words=False)
    heads = [line if text else line + beside for line in folded or [""]]
    widest = max(*map(_width, heads), *widths, 0)
    return [_pad(one, widest, left=text) for one in (*heads, "-" * widest, *shown)]


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
