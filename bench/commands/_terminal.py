"""Standard output and error of a command: no control characters, no abort by write errors."""

import os
import re
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from io import TextIOBase, TextIOWrapper
from typing import Any, ClassVar, TextIO, cast

import click

from trackmark.reports.printable import printable, wrap

MAX_LINE = 1000
"""Maximum length of a printed line of a message [characters]."""

COMMAND = "  trackmark "
"""Start of a line with a command to copy."""

_COMMAND_LINE = re.compile(r" {2,}(?:\S*/)?trackmark |.* -m trackmark ")
"""Start of a line that is neither wrapped nor shortened."""

_COLOURED = re.compile(
    r"""
    (?P<good> ^PASS\b | (?:^|(?<=\ \ )) better (?=\ \ |$) )
    | (?P<bad> ^FAIL\b | ^.*\bFAILED\b.*$ | (?:^|(?<=\ \ )) worse (?=\ \ |$) )
    """,
    re.MULTILINE | re.VERBOSE,
)
"""Texts in colour: decisions in cells of tables, and lines on failed runs."""

_ANSWER = re.compile(r"\A.*?(?:\.$|\Z)", re.MULTILINE | re.DOTALL)
"""First sentence of a paragraph."""

_INTERRUPT_DELAY = 0.01
"""Time after which an ignored Ctrl-C is repeated [s]."""


class SafeStream(TextIOBase):
    """Replacement of standard output or error.

    After a write error the remaining output is dropped and the work continues. The error is printed
    unless the reader has closed a pipe. In a terminal, texts are written above the progress bar.

    `through`: the replaced stream. `clean`: function that is applied to texts.
    """

    bar: ClassVar[Any] = None  # bar of tqdm in the last line of the terminal, or None
    line_ended: ClassVar[bool] = True  # whether the last text of a terminal ended with its line

    def __init__(self, through: TextIO, clean: Callable[[str], str] = printable) -> None:
        self.through = through
        self.failed = False  # True after an error other than a closed pipe
        # `safe_streams` sets the variable NO_COLOR for other packages later.
        uses_colours = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        self.has_colours = uses_colours and self.isatty()
        self._clean = clean
        if isinstance(through, TextIOWrapper):  # a Latin-1 terminal cannot show all characters
            through.reconfigure(errors="backslashreplace")

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, output: str | bytes, /, colour: Callable[[str], str] = str) -> int:
        """Clean a text and pass it on; click writes the texts of shell completion as bytes.

        `colour`: function that adds colours to the cleaned text, if the terminal has them.
        """
        cleaned = self._clean(output if isinstance(output, str) else output.decode())
        if self.has_colours:
            cleaned = colour(cleaned)
        if cleaned and self.isatty():
            self._write_above_bar(cleaned)
        else:
            self._attempt(self.through.write, cleaned)
        return len(output)

    def _write_above_bar(self, cleaned: str) -> None:
        """Remove the progress bar from its line, and draw it below the text."""
        bar = SafeStream.bar
        with ExitStack() as locked:
            # tqdm draws a bar with a delay later, or never.
            drawn = bar is not None and bar.last_print_t >= bar.start_t + bar.delay
            if drawn:
                locked.enter_context(bar.get_lock())
                if SafeStream.line_ended:
                    bar.clear(nolock=True)
            self._attempt(self.through.write, cleaned)
            SafeStream.line_ended = cleaned.endswith("\n")
            if drawn and SafeStream.line_ended:
                self.flush()
                bar.refresh(nolock=True)

    def flush(self) -> None:
        """Write the buffered text."""
        if not self.through.closed:  # Python 3.13 flushes closed streams, too, and reports errors
            self._attempt(self.through.flush)

    def _attempt(self, call: Callable[..., object], *arguments: str) -> None:
        try:
            call(*arguments)
        except OSError as error:
            # The text in the stream's buffer would fail again, at the latest when Python ends.
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self.fileno())
            os.close(null)
            if not isinstance(error, BrokenPipeError):
                self.failed = True
                print_error(f"the output cannot be written: {error.strerror}.")

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


def print_result(lines: Iterable[str], *, has_answer: bool = True) -> None:
    """Print an answer and tables; a terminal shows them with colours, the answer in bold type."""
    print_coloured("\n".join(lines), sys.stdout, _with_answer if has_answer else _coloured)


def print_coloured(
    printed: str, stream: TextIO | None, colour: Callable[[str], str] | None = None
) -> None:
    """Print a text; by default, a terminal shows decisions and failures in colour."""
    if isinstance(stream, SafeStream):
        stream.write(f"{printed}\n", colour or _coloured)
        stream.flush()
    else:
        click.echo(printed, file=stream)


def _coloured(printed: str) -> str:
    return _COLOURED.sub(
        lambda match: click.style(match[0], fg="green" if match["good"] else "red"), printed
    )


def _with_answer(printed: str) -> str:
    """Return the text with colours; its first sentence that is no failure is in bold type."""
    first, gap, others = printed.partition("\n\n")
    if "FAILED" in first and gap:
        return f"{_coloured(first)}{gap}{_with_answer(others)}"
    return (
        _ANSWER.sub(lambda match: click.style(match[0], bold=True), first) + gap + _coloured(others)
    )


def print_error(message: str) -> None:
    """Print an error message on standard error."""
    click.echo(f"trackmark: {message}", err=True, color=True)  # unchanged: the stream escapes it


def _shortened(message: str) -> str:
    """Return a message with the middle of overlong lines removed."""
    return "".join(
        line
        if len(line) <= MAX_LINE or _COMMAND_LINE.match(line)
        else f"{line[: MAX_LINE - 300]} … {line[-200:]}"
        for line in printable(message).splitlines(keepends=True)
    )


def _in_columns(message: str) -> str:
    """Return a message in lines of the terminal's width."""
    return "\n".join(
        line if _COMMAND_LINE.match(line) else wrap(line, sys.stderr)
        for line in _shortened(message).split("\n")
    )


def _uncut(output: str) -> str:
    """Return a text for standard output in lines that the terminal does not cut within words."""
    return wrap(printable(output), only_cut=True)


@contextmanager
def safe_streams() -> Iterator[SafeStream | None]:
    """Replace standard output and error; yield the stream of the output, if it is open."""
    out = err = None
    if sys.stdout is not None:
        out = SafeStream(sys.stdout, _uncut if sys.stdout.isatty() else printable)
    if sys.stderr is not None:
        err = SafeStream(sys.stderr, _in_columns if sys.stderr.isatty() else _shortened)
    with (
        redirect_stdout(cast("TextIO", out)),
        redirect_stderr(cast("TextIO", err)),
        # Other packages print no colours, which `SafeStream` would escape.
        environment_variable("NO_COLOR", "1"),
    ):
        yield out


@contextmanager
def environment_variable(name: str, value: str) -> Iterator[None]:
    """Set an environment variable within the context."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise `KeyboardInterrupt` within the context, unless it is ignored.

    Outside the context, Ctrl-C ends the process immediately and prints no traceback.
    """
    before, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    if before is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.unraisablehook = partial(_repeat_interrupt, hook)
    try:
        yield
    finally:
        sys.unraisablehook = hook
        if before is signal.SIG_DFL:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _repeat_interrupt(
    hook: Callable[["sys.UnraisableHookArgs"], object], unraisable: "sys.UnraisableHookArgs"
) -> None:
    """Repeat a Ctrl-C that was raised where Python ignores exceptions, as in callbacks of LLVM."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        timer = threading.Timer(_INTERRUPT_DELAY, interrupt_main)
        timer.daemon = True
        timer.start()
    else:
        hook(unraisable)


def confirm(question: str) -> None:
    """Ask a question; raise `click.Abort` unless the answer is yes."""
    if sys.stdin is None or sys.stdout is None:
        raise click.UsageError("the question cannot be answered without a terminal. Add --yes.")
    try:
        click.confirm(question, abort=True)
    except click.Abort:
        click.echo()  # ends the line of the question
        raise
