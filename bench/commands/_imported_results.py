"""Results of other toolkits, for commands that read them together with stored runs."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import matching_sequences, option
from trackmark.bench.commands._progress import print_message, refresh_index

if TYPE_CHECKING:
    from trackmark.bench.exchange.importing import ImportedTracker

ALONE = "published"
"""Name of an experiment that holds imported results only."""


def imported_option() -> Any:
    """Return the field of --results-of."""
    return option(
        "Results of another toolkit, as NAME=PATH or NAME=FORMAT:PATH. Repeatable.",
        metavar="NAME=PATH",
    )


def guests_of(texts: Sequence[str]) -> "list[ImportedTracker]":
    """Return the imported trackers of `NAME=PATH` texts; raise `ExchangeError` for wrong ones."""
    if not texts:
        return []
    from trackmark.bench.exchange.importing import parse_imported_tracker

    guests = [parse_imported_tracker(text) for text in texts]
    labels = [guest.tracker for guest in guests]
    if repeated := [label for label in labels if labels.count(label) > 1]:
        raise click.UsageError(f"--results-of names {repeated[0]} twice.")
    return guests


def import_guests(
    guests: "Sequence[ImportedTracker]",
    sequences: str,
    folder: Path,
    report: Callable[[str], None] = print_message,
) -> int:
    """Store imported results on sequences in an experiment's folder; return the number of runs."""
    from trackmark.bench.exchange.importing import import_results, open_sequences

    by_sequence = open_sequences(matching_sequences(sequences), folder)
    number = import_results(guests, by_sequence, folder, report)
    refresh_index(folder)
    return number


@contextmanager
def with_imported(
    experiments: Sequence[Path],
    guests: "Sequence[ImportedTracker]",
    sequences: str | None = None,
    only: Collection[str] | None = None,
) -> Iterator[list[Path]]:
    """Yield folders of the experiments with imported results in each; read each run once.

    Without experiments the imported results on `sequences` are one. `only`: names of the sequences
    of the experiments on which results are imported; all by default.
    """
    from trackmark.bench.store.results import RunCache, run_cache

    with ExitStack() as stack:
        stack.callback(run_cache.reset, run_cache.set(RunCache()))
        if not experiments:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="trackmark-"))) / ALONE
            import_guests(guests, sequences or "", folder)
            yield [folder]
            return
        for experiment in experiments:
            refresh_index(experiment)
        if not guests:
            yield list(experiments)
            return
        from trackmark.bench.exchange.importing import copy_with_imports

        yield [
            stack.enter_context(copy_with_imports(experiment, guests, print_message, only))
            for experiment in experiments
        ]
