"""Results of other toolkits that commands read together with stored runs."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import matching_sequences, option
from trackmark.bench.commands._progress import print_message, report_slow_work

if TYPE_CHECKING:
    from trackmark.bench.exchange.importing import ImportedTracker
    from trackmark.bench.store.runs import Runs

IMPORTED_ONLY = "published"
"""Title of runs that are only imported results."""


def imported_option() -> Any:
    """Return the field of --results-of."""
    return option(
        "Results of another toolkit, as NAME=PATH or NAME=FORMAT:PATH. Repeatable.",
        metavar="NAME=PATH",
    )


def parse_imported(arguments: Sequence[str]) -> "list[ImportedTracker]":
    """Return the imported trackers of `NAME=PATH` texts.

    Raises `ExchangeError` for a malformed text and `UsageError` for a repeated name.
    """
    if not arguments:
        return []
    from trackmark.bench.exchange.importing import parse_imported_tracker

    imported = [parse_imported_tracker(argument) for argument in arguments]
    labels = [tracker.tracker for tracker in imported]
    if repeated := [label for label in labels if labels.count(label) > 1]:
        raise click.UsageError(f"--results-of: the name {repeated[0]} is given twice.")
    return imported


def store_imported(imported: "Sequence[ImportedTracker]", sequences: str, folder: Path) -> int:
    """Store imported results on sequences in a results folder; return the number of runs."""
    from trackmark.bench.exchange.importing import import_results, open_sequences

    opened = open_sequences(matching_sequences(sequences), print_message)
    with report_slow_work("Importing results"):
        return import_results(imported, opened, folder, print_message)


def with_imported(runs: "Runs", imported: "Sequence[ImportedTracker]") -> "Runs":
    """Return runs together with imported results on their sequences."""
    from trackmark.bench.exchange.importing import with_imported_runs

    return with_imported_runs(runs, imported, print_message)


def imported_runs(imported: "Sequence[ImportedTracker]", sequences: str) -> "Runs":
    """Return imported results on sequences as runs in memory."""
    from trackmark.bench.exchange.importing import open_sequences, read_runs
    from trackmark.bench.store.runs import Runs

    opened = open_sequences(matching_sequences(sequences), print_message)
    runs = read_runs(imported, opened, print_message)
    return Runs.in_memory(runs, opened, IMPORTED_ONLY)
