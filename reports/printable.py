"""Conversion of foreign texts, such as names and error messages, for output.

Control characters in a text could move the cursor of a terminal, hide lines or set the title of the
window. They are replaced by their numbers in the notation of JSON, which keeps a JSON text valid.
"""

import os
import re
import shutil
import textwrap
from contextlib import suppress
from typing import TextIO

MAX_WIDTH = 80
"""Maximum number of terminal columns that tables and texts use."""

_MIN_WIDTH = 20
"""Minimum number of columns to which texts are wrapped; tables have at least 60."""

# Characters that move or hide text: controls, marks of the writing direction, and surrogates, which
# cannot be encoded (file names that are not UTF-8 contain them).
_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff"
_LABEL = re.compile(r" *\S.{,40}?  +")
_JSON_OR_CELLS = re.compile(r"[{\[]|.*\S {2,}\S.*\S {2,}\S")
_NONCHARACTER = re.compile("[\ufffe\uffff]")
_CONTROL = re.compile(f"[{_CONTROLS}]")
_CONTROL_OR_BREAK = re.compile(rf"[{_CONTROLS}\t\n\u2028\u2029]")

_MINUS = re.compile(r"(?:(?<=[\s\[(~<>≤≥±])|^)-(?=\.?\d)")


def width() -> int:
    """Return the columns for tables: those of the terminal, from 60 to `MAX_WIDTH`."""
    return max(60, min(MAX_WIDTH, columns()))


def columns(stream: TextIO | None = None) -> int:
    """Return the columns of the terminal of a stream, by default standard output, or `MAX_WIDTH`.

    The environment variable `COLUMNS` takes precedence.
    """
    n_columns = shutil.get_terminal_size((0, 0)).columns
    if not n_columns and stream is not None:
        with suppress(OSError, ValueError):  # no terminal, or closed
            n_columns = os.get_terminal_size(stream.fileno()).columns
    return n_columns or MAX_WIDTH


def printable(foreign: str) -> str:
    r"""Return the text with control characters as `\u001b`; line ends and tabs are kept.

    >>> printable("\x1b[31mred\n")
    '\\u001b[31mred\n'
    """
    return _CONTROL.sub(_escaped, foreign)


def with_minus(printed: str) -> str:
    """Return a printed text with true minus signs before its numbers; they are as wide as `+`.

    >>> with_minus("-0.2 [-0.3, +0.1] clip-01")
    '−0.2 [−0.3, +0.1] clip-01'
    """
    return _MINUS.sub("−", printed)


def one_line(foreign: str) -> str:
    r"""Return the text with control characters, tabs and line ends as `\u000a`.

    >>> one_line("two\nlines")
    'two\\u000alines'
    """
    return _CONTROL_OR_BREAK.sub(_escaped, foreign)


def to_xml(foreign: str) -> str:
    r"""Return the text with the characters that XML 1.0 cannot hold as `\u0000`.

    >>> to_xml("\x00\ufffe")
    '\\u0000\\ufffe'
    """
    return _NONCHARACTER.sub(_escaped, printable(foreign))


def wrap(paragraphs: str, stream: TextIO | None = None, *, only_cut: bool = False) -> str:
    """Wrap paragraphs to the terminal, at most `MAX_WIDTH`, without breaking names and numbers.

    A paragraph is indented like its first line. A text after a label and two spaces is indented to
    the right of the label. `stream`: as in `columns`. If `only_cut`, only lines that the terminal
    would cut are wrapped, but neither JSON nor rows of tables: cells would stand below others.
    """
    available = columns(stream)
    limit = available if only_cut else min(MAX_WIDTH, available)
    text_width = max(_MIN_WIDTH, min(MAX_WIDTH, available))
    lines = []
    for line in paragraphs.split("\n"):
        is_kept = len(line) <= limit or (only_cut and _JSON_OR_CELLS.match(line))
        lines.append(line if is_kept else _fill(line, text_width))
    return "\n".join(lines)


def _fill(line: str, text_width: int) -> str:
    label = _LABEL.match(line)
    start = label[0] if label else line[: len(line) - len(line.lstrip())]
    return textwrap.fill(
        line,
        text_width,
        subsequent_indent=" " * min(len(start), text_width // 2),
        break_long_words=False,
        break_on_hyphens=False,
    )


def _escaped(match: re.Match[str]) -> str:
    return f"\\u{ord(match[0]):04x}"
