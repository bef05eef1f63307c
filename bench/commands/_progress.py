"""Progress of long work: a bar in a terminal, complete lines that start with the time elsewhere."""

import logging
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import click

from trackmark.bench.commands._terminal import SafeStream, print_coloured
from trackmark.reports.printable import columns

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.store.runs import Runs

NOTICE_DELAY = 2.0
"""Time after which a message names work that is not finished yet [s]."""

INTERVAL = 60.0
"""Time between two lines of progress outside a terminal [s]."""

_MAX_FAILURES = 3
"""Maximum number of failed runs that progress names; later ones are only counted."""

_BAR_COLUMNS = 60
"""Minimum number of columns for a bar next to the counts of runs."""

_MIN_SHARE = 0.02
"""Minimum share of the work whose rate gives an estimate of the time left."""

_MIN_SECONDS = 3.0
"""Minimum time of this work [s]."""


class _Screen:
    """State of standard error during one command."""

    quiet: ClassVar[bool] = False  # True if progress and hints are not printed
    announced: ClassVar[set[str]] = set()  # names of work, and messages, that were already printed


@contextmanager
def command_messages() -> Iterator[None]:
    """Within the context, print log messages of trackmark, and names of long work once each."""
    _Screen.quiet, _Screen.announced = False, set()
    logger, handler = logging.getLogger("trackmark"), _LogHandler()
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class _LogHandler(logging.Handler):
    """Handler that prints each message once."""

    def emit(self, record: logging.LogRecord) -> None:
        """See `logging.Handler`."""
        message = record.getMessage()
        if message not in _Screen.announced:
            _Screen.announced.add(message)
            print_event("note", message)


def silence_progress() -> None:
    """Print no progress and no hints until the command ends."""
    _Screen.quiet = True


def print_message(message: str) -> None:
    """Write a line to standard error."""
    click.echo(message, err=True)


def print_hint(hint: str) -> None:
    """Write a line to standard error, except with --quiet."""
    if not _Screen.quiet:
        print_message(hint)


def print_event(event: str, message: str) -> None:
    """Write a line to standard error; outside a terminal, it starts with the time and `event`."""
    line = message if _in_terminal() else f"{time.strftime('%H:%M:%S')} {event:<8} {message}"
    print_coloured(line, sys.stderr)


def print_progress(event: str, message: str) -> None:
    """Write a line as `print_event` does, except with --quiet."""
    if not _Screen.quiet:
        print_event(event, message)


def _in_terminal() -> bool:
    """Return whether standard error is a terminal that can draw a bar."""
    can_draw = os.environ.get("TERM") != "dumb"
    return can_draw and sys.stderr is not None and sys.stderr.isatty()


def duration(seconds: float) -> str:
    """Return a duration as text.

    >>> duration(701), duration(30.2), duration(0.2), duration(7500)
    ('11 min 41 s', '30 s', '1 s', '2 h 5 min')
    """
    rounded = max(1, round(seconds))
    if rounded < 60:
        return f"{rounded} s"
    minutes, rest = divmod(rounded, 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def rough_duration(seconds: float) -> str:
    """Return an estimated duration as text, without a precision that the estimate does not have."""
    return f"{round(seconds / 60)} min" if 90 < seconds < 3600 else duration(seconds)


class Progress(Protocol):
    """Callback with the work done so far, and the whole work if it was not known before."""

    def __call__(self, done: int, n_total: int | None = None, /) -> None: ...


@contextmanager
def report_slow_work(work: str, total: int | None = None) -> Iterator[Progress]:
    """Print a line with the work and its progress if it takes longer than `NOTICE_DELAY`.

    The line is repeated: in a terminal at growing intervals, elsewhere after each `INTERVAL`.
    """
    progress = ""
    ended = threading.Event()

    def count(done: int, n_total: int | None = None) -> None:
        nonlocal progress, total
        total = n_total or total
        progress = f": {done} of {total}" if total else ""

    def watch() -> None:
        wait = NOTICE_DELAY
        while not ended.wait(wait):
            if progress or work not in _Screen.announced:
                _Screen.announced.add(work)
                print_progress("wait", f"{work}{progress} …")
            wait = min(2 * wait, INTERVAL) if _in_terminal() else INTERVAL

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield count
    finally:
        ended.set()
        thread.join()


@contextmanager
def _bar(total: int | None, work: str = "", delay: float = 0.0) -> Iterator[Any]:
    """Show a bar in the last line of the terminal, followed by a text if there is space.

    Within the context, all messages of the command are written above the bar.
    """
    from tqdm import tqdm

    stream = sys.stderr
    bar = tqdm(
        total=total,
        desc=work,
        # Without escaping, for the control characters of the bar.
        file=stream.through if isinstance(stream, SafeStream) else stream,
        bar_format="[{bar:20}] {desc}" if columns(stream) >= _BAR_COLUMNS else "{desc}",
        ascii=".#",
        dynamic_ncols=True,
        delay=delay,
    )
    SafeStream.bar = bar
    try:
        with bar:
            yield bar
    finally:
        SafeStream.bar = None


class _TimeLeft:
    """Estimate of the time left from the rate of work since a first share of `_MIN_SHARE`.

    The time before does not count: workers start, initialise trackers and compile kernels in it,
    which can take longer than the work itself.
    """

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None  # time [s] and share at its start

    def after(self, seconds: float, share: float) -> str:
        """Return the estimate after a time and a share of the work; empty if there is none yet."""
        if self._first is None or share < _MIN_SHARE:
            self._first = (seconds, share) if share > 0 else None
            return ""
        duration, done = seconds - self._first[0], share - self._first[1]
        if share >= 1 or done < _MIN_SHARE or duration < _MIN_SECONDS:
            return ""
        return f", about {rough_duration(duration * (1 - share) / done)} left"


@contextmanager
def progress_bar(work: str, total: int | None, unit: str) -> Iterator[Progress]:
    """Show a bar with the time left in a terminal, and lines of `report_slow_work` elsewhere.

    A terminal has one bar at a time: within another bar, there are lines.
    """
    if _Screen.quiet or not _in_terminal() or SafeStream.bar is not None:
        with report_slow_work(work, total) as count:
            yield count
        return
    began, time_left = time.monotonic(), _TimeLeft()
    with _bar(total, work, delay=1.0) as bar:

        def update(done: int, n_total: int | None = None) -> None:
            bar.total = n_total or bar.total
            if bar.total:
                left = time_left.after(time.monotonic() - began, done / bar.total)
                counts = f"{work}: {done}/{bar.total} {unit}s{left}"
                bar.set_description_str(counts, refresh=False)
            bar.update(done - bar.n)

        yield update


class RunProgress:
    """Progress of the runs of a command, which may need several executions.

    A terminal shows a title and a bar. Elsewhere there is a line at the start, one after each
    `INTERVAL`, and one at the end. Nothing is printed if no run is missing. `folder` is the results
    folder; None if it is temporary.
    """

    def __init__(self, title: str, folder: Path | None = None) -> None:
        self._title, self.folder = title, folder
        self._runs = self._work = self._done = self._failed = 0
        self._work_before = self._work_now = 0  # work done in earlier executions, and now
        self._ended, self._stack = threading.Event(), ExitStack()
        self._failures: list[str] = []  # printed failures
        self._bar: Any = None
        self._began = 0.0
        self._estimate = _TimeLeft()

    def __enter__(self) -> Self:
        """Return the progress."""
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        _: TracebackType | None,
    ) -> None:
        """Print the end, unless the work was aborted."""
        self._ended.set()
        self._show()
        self._stack.close()
        if error_type is None and self._began and self._bar is None:
            where = f", {self.folder}" if self.folder else ""
            print_event("done", f"{self._counts()}, {duration(self._seconds())}{where}")

    def expect(self, *executions: "Execution") -> None:
        """Add the missing runs of executions to the expected runs."""
        for execution in executions:
            self._runs += execution.tasks.n_runs
            self._work += execution.tasks.work

    def begin(self) -> None:
        """Start an execution; the first one prints the title."""
        self._work_before += self._work_now
        self._work_now = 0
        if self._began or not self._runs or _Screen.quiet:
            return
        self._began = time.monotonic()
        print_event("start", self._title)
        if _in_terminal():
            self._bar = self._stack.enter_context(_bar(self._work))
            self._show()
        else:
            thread = threading.Thread(target=self._print_lines, daemon=True)
            thread.start()
            self._stack.callback(thread.join)

    def update(self, done: int) -> None:
        """Show the work that the present execution has done."""
        self._work_now = done
        self._time_left()  # notes the first progress, also if no line is due
        self._show()

    def add(self, row: Mapping[str, Any]) -> None:
        """Count a run that has ended; print its failure, if any."""
        self._done += 1
        self._show()
        if row["status"] != "failed":
            return
        self._failed += 1
        reason = str(row["failure"]).partition("\n")[0]
        message = f"{row['tracker']} on {row['sequence']}, {reason}"
        if len(self._failures) < _MAX_FAILURES and message not in self._failures:
            self._failures.append(message)
            print_progress("FAILED", f"FAILED  {message}" if _in_terminal() else message)

    def _show(self) -> None:
        if self._bar is not None:
            self._bar.total, self._bar.n = self._work, self._work_before + self._work_now
            end = f", {duration(self._seconds())}" if self._ended.is_set() else self._time_left()
            self._bar.set_description_str(f"{self._counts()}{end}")

    def _counts(self) -> str:
        return f"{self._done}/{self._runs} runs, {self._failed} failed"

    def _print_lines(self) -> None:
        while not self._ended.wait(INTERVAL):
            share = self._share()
            runs = f"{self._done:>4}/{self._runs} {share:4.0%}  {self._failed} failed"
            print_event("run", runs + self._time_left().replace(",", " ", 1))

    def _share(self) -> float:
        return min(1.0, (self._work_before + self._work_now) / max(1, self._work))

    def _seconds(self) -> float:
        return time.monotonic() - self._began

    def _time_left(self) -> str:
        return self._estimate.after(self._seconds(), self._share())


def print_corner_hints(runs: "Runs") -> None:
    """Print a hint for each tracker that seems to return corners."""
    from trackmark.bench.analysis.run_checks import corner_boxes

    for hint in corner_boxes(runs):
        print_event("warning", hint)


def open_runs(folder: Path) -> "Runs":
    """Return the runs in a results folder, with a progress bar while runs are scored."""
    from trackmark.bench.store.runs import Runs

    with progress_bar("Scoring stored runs", None, "run") as progress:
        return Runs.open(folder, progress)
