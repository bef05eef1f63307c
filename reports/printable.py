"""Conversion of foreign texts, such as names and error messages, for output.

Control characters in a text could move the cursor of a terminal, hide lines or set the title of the
window. They are replaced by their numbers in the notation of JSON, which keeps a JSON text valid.
"""

import re
import shutil
import textwrap

MAX_WIDTH = 80
"""Maximum number of terminal columns that tables and texts use."""

# Characters that move or hide text: controls, marks of the writing direction, and surrogates, which
# cannot be encoded (file names that are not UTF-8 contain them).
_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff"
_LABEL = re.compile(r" *\S.{,40}?  +")
_NONCHARACTER = re.compile("[\ufffe\uffff]")
_CONTROL = re.compile(f"[{_CONTROLS}]")
_CONTROL_OR_BREAK = re.compile(rf"[{_CONTROLS}\t\n\u2028\u2029]")


def width() -> int:
    """Return the columns of the terminal, from 60 to `MAX_WIDTH`; `MAX_WIDTH` without terminal."""
    return max(60, min(MAX_WIDTH, shutil.get_terminal_size((MAX_WIDTH, 24)).columns))


def printable(text: str) -> str:
    r"""Return the text with control characters as `\u001b`; line ends and tabs are kept.

    >>> printable("\x1b[31mred\n")
    '\\u001b[31mred\n'
    """
    return _CONTROL.sub(_number, text)


def one_line(text: str) -> str:
    r"""Return the text with control characters, tabs and line ends as `\u000a`.

    >>> one_line("two\nlines")
    'two\\u000alines'
    """
    return _CONTROL_OR_BREAK.sub(_number, text)


def to_xml(text: str) -> str:
    r"""Return the text with the characters that XML 1.0 cannot hold as `\u0000`.

    >>> to_xml("\x00\ufffe")
    '\\u0000\\ufffe'
    """
    return _NONCHARACTER.sub(_number, printable(text))


def wrap(text: str) -> str:
    """Wrap a text to `width()` columns without breaking names and numbers.

    A text after a label and two spaces is indented to the right of the label.
    """
    return "\n".join(
        line if len(line) <= width() else _fill(line, _LABEL.match(line))
        for line in text.split("\n")
    )


def _fill(line: str, label: re.Match[str] | None) -> str:
    indent = " " * len(label[0] if label else "")
    return textwrap.fill(
        line, width(), subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _number(match: re.Match[str]) -> str:
    return f"\\u{ord(match[0]):04x}"
