"""Progress of long work: a bar in a terminal, a line elsewhere."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Protocol

import click

from trackmark.bench.commands._terminal import progress_outlet

PATIENCE = 2.0
"""Time after which a message names the work that shows no progress [s]."""


def print_message(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)


@contextmanager
def patience(
    work: str, print_line: Callable[[str], None] = print_message
) -> Iterator[Callable[[int, int], None]]:
    """Print a line with the work and its progress if it takes longer than `PATIENCE`.

    In a terminal, the line is repeated at growing intervals.
    """
    progress = ""
    done = threading.Event()
    repeat = sys.stderr is not None and sys.stderr.isatty()

    def count(n_done: int, n_total: int) -> None:
        nonlocal progress
        progress = f": {n_done} of {n_total}"

    def watch() -> None:
        wait = PATIENCE
        while not done.wait(wait):
            print_line(f"{work}{progress} …")
            wait = min(2 * wait, 60.0) if repeat else threading.TIMEOUT_MAX

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield count
    finally:
        done.set()
        thread.join()


class Progress(Protocol):
    """Callback with the work done so far, and the whole work if it was not known before."""

    def __call__(self, done: int, total: int | None = None) -> None: ...


@contextmanager
def progress_bar(total: int | None, unit: str) -> Iterator[Progress]:
    """Show a progress bar with the time left; none if standard error is not a terminal."""
    from tqdm import tqdm

    with (
        tqdm(
            total=total, file=progress_outlet(), unit=unit, unit_scale=True, disable=None, delay=1.0
        ) as bar,
        ExitStack() as waiting,
    ):

        def appear(text: str) -> None:
            bar.delay = 0.0  # so that tqdm also closes a bar without progress
            bar.refresh()

        # A printed line would break the bar, and the bar itself shows a lack of progress.
        print_line = print_message if bar.disable else appear
        work = f"Waiting for the first {unit}" if total else f"Looking for {unit}s"
        waiting.enter_context(patience(work, print_line))

        def update(done: int, total: int | None = None) -> None:
            if done:
                waiting.close()
            bar.total = total or bar.total
            bar.update(done - bar.n)

        yield update


def refresh_index(folder: Path) -> None:
    """Score the stored runs of an experiment that have no scores yet."""
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.run_rows import list_scored_runs

    with progress_bar(None, "run") as progress:
        list_scored_runs(Results(folder), progress)
