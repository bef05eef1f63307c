"""Texts of others (names, what a tracker raised) as they may be shown.

A terminal obeys control characters: such a text could move the cursor, hide lines or set the
window's title. They are shown by their numbers instead, as JSON writes them, so that a JSON text
stays the same JSON.
"""

import re
import shutil
import textwrap

WIDTH = 100
"""Columns of a terminal that is not narrow."""

# What moves or hides text: controls, the marks that turn the direction of writing round, and
# halves of characters, which no encoding has (file names that are not UTF-8 hold them).
_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff"
_LABEL = re.compile(r" *\S.{,40}?  +")
_NONCHARACTER = re.compile("[\ufffe\uffff]")
_CONTROL = re.compile(f"[{_CONTROLS}]")
_CONTROL_OR_BREAK = re.compile(rf"[{_CONTROLS}\t\n\u2028\u2029]")


def width() -> int:
    """Columns of the terminal, from 60 to `WIDTH`; `WIDTH` where there is no terminal."""
    return max(60, min(WIDTH, shutil.get_terminal_size((WIDTH, 24)).columns))


def printable(text: str) -> str:
    r"""Give the text with control characters as `\u001b`; lines and tabs stay.

    >>> printable("\x1b[31mred\n")
    '\\u001b[31mred\n'
    """
    return _CONTROL.sub(_number, text)


def one_line(text: str) -> str:
    r"""Give the text with tabs and ends of lines shown so, too.

    >>> one_line("two\nlines")
    'two\\u000alines'
    """
    return _CONTROL_OR_BREAK.sub(_number, text)


def in_xml(text: str) -> str:
    r"""Return the text with the characters that XML 1.0 cannot hold as `\u0000`.

    >>> in_xml("\x00\ufffe")
    '\\u0000\\ufffe'
    """
    return _NONCHARACTER.sub(_number, printable(text))


def wrapped(text: str) -> str:
    """Give the text in lines of `width()` columns; names and numbers stay whole.

    What two spaces part from a label stays to the right of that.
    """
    return "\n".join(
        line if len(line) <= width() else _filled(line, _LABEL.match(line))
        for line in text.split("\n")
    )


def _filled(line: str, label: re.Match[str] | None) -> str:
    indent = " " * len(label[0] if label else "")
    return textwrap.fill(
        line, width(), subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _number(found: re.Match[str]) -> str:
    return f"\\u{ord(found[0]):04x}"
