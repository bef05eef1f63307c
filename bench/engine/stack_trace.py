"""Stack trace of a worker that crashed or hung, as `faulthandler` writes it."""

import re
import signal
from pathlib import Path, PurePath
from typing import NamedTuple

FATAL_SIGNALS = frozenset(
    {signal.SIGSEGV, signal.SIGFPE, signal.SIGABRT, signal.SIGBUS, signal.SIGILL}
)
"""Signals at which `faulthandler` writes a stack trace."""

_HEAD = "Stack (most recent call first):\n"
_LINE = re.compile(r'^  File "(.*)", line (\d+) in (.*)$', re.MULTILINE)
_ESCAPE = re.compile(r"\\(?:x([0-9a-f]{2})|u([0-9a-f]{4})|U([0-9a-f]{8}))")


class CodeLine(NamedTuple):
    """Line of source code in a stack trace."""

    file: str  # path; `faulthandler` escapes all but ASCII
    number: int
    function: str

    def __str__(self) -> str:
        return f"{PurePath(self.file).name}, line {self.number}, in {self.function}"


def parse_stack(text: str) -> list[CodeLine]:
    """Return the last stack trace in a text, innermost line first; empty if the text has none."""
    _, head, stack = text.rpartition(_HEAD)
    matches = _LINE.findall(stack) if head else []
    return [CodeLine(file, int(number), function) for file, number, function in matches]


def select_line(stack: list[CodeLine], file: Path | None) -> CodeLine:
    """Return the innermost line of a tracker's file, or of any file if that file does not occur."""
    tracker_lines = [
        line for line in stack if file and Path(_unescape(line.file)).resolve() == file.resolve()
    ]
    return (tracker_lines or stack)[0]


def _unescape(text: str) -> str:
    return _ESCAPE.sub(lambda match: chr(int(match[1] or match[2] or match[3], 16)), text)
