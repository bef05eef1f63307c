"""What the command writes: harmless to a terminal, and never the end of the work."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import TextIOBase, TextIOWrapper
from typing import TextIO, cast

import click

from trackmark.reports.printable import printable, wrapped

LONGEST = 1000
"""Characters of a message's line that are shown."""


class Outlet(TextIOBase):
    """Stands for standard output or error.

    What can't be written any more is dropped: a reader that went away wants no more, and a disk
    that is full is told in a line; the work goes on.

    `through`: the real one. `cleaned`: what is done to texts before.
    """

    def __init__(self, through: TextIO, cleaned: Callable[[str], str] = printable) -> None:
        self.through = through
        self.failed = False  # but for a reader that went away
        self._cleaned = cleaned
        if isinstance(through, TextIOWrapper):  # a Latin-1 terminal lacks signs of ours
            through.reconfigure(errors="backslashreplace")

    def writable(self) -> bool:
        """Yes."""
        return True

    def write(self, text: str, /) -> int:
        """Clean the text and pass it on."""
        shown = self._cleaned(text)
        self._attempt(lambda: self.through.write(shown))
        return len(text)

    def flush(self) -> None:
        """Write the buffered text. A closed stream has none; Python 3.13 reports its error."""
        if not self.through.closed:
            self._attempt(self.through.flush)

    def _attempt(self, call: Callable[[], object]) -> None:
        try:
            call()
        except OSError as error:
            # What the real one holds back would fail again, at the latest when Python ends.
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if not isinstance(error, BrokenPipeError):
                self.failed = True
                complain(f"the output can't be written: {error.strerror}.")

    def fileno(self) -> int:
        """Descriptor of the real one."""
        return self.through.fileno()

    def isatty(self) -> bool:
        """Whether the real one is a terminal."""
        return self.through.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]  # the stub lets it be set
        """That of the real one."""
        return self.through.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]  # as above
        """That of the real one."""
        return self.through.errors


def complain(text: str) -> None:
    """Say what is wrong on standard error, in a line."""
    click.echo(f"trackmark: {text}", err=True, color=True)  # that is: unchanged


def _shortened(text: str) -> str:
    """Give a message whose lines fit a terminal, however long the names are that it quotes."""
    return "".join(
        line if len(line) <= LONGEST else f"{line[: LONGEST - 300]} … {line[-200:]}"
        for line in printable(text).splitlines(keepends=True)
    )


def _in_columns(text: str) -> str:
    """Give a message in lines of a terminal's width; what is no terminal gets a message a line."""
    return wrapped(_shortened(text))


@contextmanager
def outlets() -> Iterator[Outlet | None]:
    """Have all that is written go through outlets; gives that of standard output, if it is open."""
    out = None if sys.stdout is None else Outlet(sys.stdout)
    err = None
    if sys.stderr is not None:
        err = Outlet(sys.stderr, _in_columns if sys.stderr.isatty() else _shortened)
    with redirect_stdout(cast("TextIO", out)), redirect_stderr(cast("TextIO", err)):
        yield out


def progress_outlet() -> TextIO:
    """Give standard error for a progress bar, which moves the cursor."""
    real = sys.stderr.through if isinstance(sys.stderr, Outlet) else sys.stderr
    return cast("TextIO", Outlet(real, str))


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise `KeyboardInterrupt`; before and after it ends a command by itself.

    There it would be a traceback out of an import. Whoever started us to ignore it is obeyed.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        if before is signal.SIG_DFL:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
