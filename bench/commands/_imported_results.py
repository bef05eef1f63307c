"""Results of other toolkits that commands read together with stored runs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._options import matching_sequences
from trackmark.bench.commands._progress import print_message

if TYPE_CHECKING:
    from trackmark.bench.exchange.importing import ImportedTracker
    from trackmark.bench.store.runs import Runs


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


def with_imported(runs: "Runs", imported: "Sequence[ImportedTracker]") -> "Runs":
    """Return runs together with imported results on their sequences, if there are any."""
    if not imported:
        return runs
    from trackmark.bench.exchange.importing import with_imported_runs

    return with_imported_runs(runs, imported, print_message)


def imported_runs(imported: "Sequence[ImportedTracker]", sequences: str) -> "Runs":
    """Return imported results on sequences as runs in memory."""
    from trackmark.bench.exchange.importing import open_sequences, read_runs
    from trackmark.bench.store.runs import Runs

    opened = open_sequences(matching_sequences(sequences), print_message)
    runs = read_runs(imported, opened, print_message)
    return Runs.in_memory(runs, opened, "published")
