"""Standard output and error of a command: no control characters, no abort by write errors."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import TextIOBase, TextIOWrapper
from typing import TextIO, cast

import click

from trackmark.reports.printable import printable, wrap

MAX_LINE = 1000
"""Maximum length of a printed line of a message [characters]."""


class Outlet(TextIOBase):
    """Replacement of standard output or error.

    After a write error the remaining output is dropped and the work continues. The error is printed
    unless the reader has closed a pipe.

    `through`: the replaced stream. `clean`: function that is applied to texts.
    """

    def __init__(self, through: TextIO, clean: Callable[[str], str] = printable) -> None:
        self.through = through
        self.failed = False  # True after an error other than a closed pipe
        self._clean = clean
        if isinstance(through, TextIOWrapper):  # a Latin-1 terminal cannot show all characters
            through.reconfigure(errors="backslashreplace")

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, text: str | bytes, /) -> int:
        """Clean the text and pass it on; click writes the texts of shell completion as bytes."""
        cleaned = self._clean(text if isinstance(text, str) else text.decode())
        self._attempt(lambda: self.through.write(cleaned))
        return len(text)

    def flush(self) -> None:
        """Write the buffered text."""
        if not self.through.closed:  # Python 3.13 flushes closed streams, too, and reports errors
            self._attempt(self.through.flush)

    def _attempt(self, call: Callable[[], object]) -> None:
        try:
            call()
        except OSError as error:
            # The text in the stream's buffer would fail again, at the latest when Python ends.
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self.fileno())
            os.close(null)
            if not isinstance(error, BrokenPipeError):
                self.failed = True
                complain(f"the output cannot be written: {error.strerror}.")

    def fileno(self) -> int:
        """Return the descriptor of the replaced stream."""
        return self.through.fileno()

    def isatty(self) -> bool:
        """Return whether the replaced stream is a terminal."""
        return not self.through.closed and self.through.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]  # the stub lets it be set
        """See `TextIOBase`."""
        return self.through.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]  # as above
        """See `TextIOBase`."""
        return self.through.errors


def complain(text: str) -> None:
    """Print an error message on standard error."""
    click.echo(f"trackmark: {text}", err=True, color=True)  # unchanged: the outlet escapes it


def _shortened(text: str) -> str:
    """Return a message with the middle of overlong lines removed."""
    return "".join(
        line if len(line) <= MAX_LINE else f"{line[: MAX_LINE - 300]} … {line[-200:]}"
        for line in printable(text).splitlines(keepends=True)
    )


def _in_columns(text: str) -> str:
    """Return a message in lines of the terminal's width."""
    return wrap(_shortened(text))


@contextmanager
def outlets() -> Iterator[Outlet | None]:
    """Replace standard output and error; yield the outlet of the output, if it is open."""
    out = None if sys.stdout is None else Outlet(sys.stdout)
    err = None
    if sys.stderr is not None:
        err = Outlet(sys.stderr, _in_columns if sys.stderr.isatty() else _shortened)
    with redirect_stdout(cast("TextIO", out)), redirect_stderr(cast("TextIO", err)):
        yield out


def progress_outlet() -> TextIO:
    """Return standard error without escaping, for the control characters of a progress bar."""
    real = sys.stderr.through if isinstance(sys.stderr, Outlet) else sys.stderr
    return cast("TextIO", Outlet(real, str))


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise `KeyboardInterrupt` within the context, unless it is ignored.

    Outside the context, Ctrl-C ends the process immediately and prints no traceback.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        if before is signal.SIG_DFL:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
