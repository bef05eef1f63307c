"""Results of other toolkits that commands read together with stored runs."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import matching_sequences, option
from trackmark.bench.commands._progress import print_message, score_stored_runs
from trackmark.reports.temporary_paths import temporary_folder

if TYPE_CHECKING:
    from trackmark.bench.exchange.importing import ImportedTracker

ALONE = "published"
"""Name of an experiment that contains imported results only."""


def imported_option() -> Any:
    """Return the field of --results-of."""
    return option(
        "Results of another toolkit, as NAME=PATH or NAME=FORMAT:PATH. Repeatable.",
        metavar="NAME=PATH",
    )


def parse_imported(texts: Sequence[str]) -> "list[ImportedTracker]":
    """Return the imported trackers of `NAME=PATH` texts.

    Raises `ExchangeError` for a malformed text and `UsageError` for a repeated name.
    """
    if not texts:
        return []
    from trackmark.bench.exchange.importing import parse_imported_tracker

    imported = [parse_imported_tracker(text) for text in texts]
    labels = [entry.tracker for entry in imported]
    if repeated := [label for label in labels if labels.count(label) > 1]:
        raise click.UsageError(f"--results-of: the name {repeated[0]} is given twice.")
    return imported


def store_imported(
    imported: "Sequence[ImportedTracker]",
    sequences: str,
    folder: Path,
) -> int:
    """Store imported results on sequences in a results folder; return the number of runs."""
    from trackmark.bench.exchange.importing import import_results, open_sequences

    by_sequence = open_sequences(matching_sequences(sequences), folder, print_message)
    number = import_results(imported, by_sequence, folder, print_message)
    score_stored_runs(folder)
    return number


@contextmanager
def with_imported(
    experiments: Sequence[Path],
    imported: "Sequence[ImportedTracker]",
    sequences: str | None = None,
    only: Collection[str] | None = None,
) -> Iterator[list[Path]]:
    """Yield a results folder per experiment with its runs and the imported results.

    If there are no experiments, yield one folder with the imported results on `sequences`. Within
    the context, each run is read from disk once. `only`: names of the sequences for which results
    are imported; all by default.
    """
    from trackmark.bench.store.results import RunCache, run_cache

    with ExitStack() as stack:
        stack.callback(run_cache.reset, run_cache.set(RunCache()))
        if not experiments:
            folder = stack.enter_context(temporary_folder()) / ALONE
            store_imported(imported, sequences or "", folder)
            yield [folder]
            return
        for experiment in experiments:
            score_stored_runs(experiment)
        if not imported:
            yield list(experiments)
            return
        from trackmark.bench.exchange.importing import copy_with_imports

        yield [
            stack.enter_context(copy_with_imports(experiment, imported, print_message, only))
            for experiment in experiments
        ]
