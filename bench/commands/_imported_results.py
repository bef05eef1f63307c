"""Others' results beside ours, for the commands that show them together."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._options import chosen_sequences, refresh_index, say

if TYPE_CHECKING:
    from trackmark.bench.exchange.importing import Guest

ALONE = "published"
"""What results of others are called where nothing of ours is beside them."""

guests_option = click.option(
    "--results-of",
    "results_of",
    multiple=True,
    metavar="NAME=PATH",
    help="Others' results of a tracker, as NAME=PATH or NAME=LAYOUT:PATH; may be repeated.",
)


def guests_of(texts: Sequence[str]) -> "list[Guest]":
    """Trackers whose results are others', of `NAME=PATH`; raises `ExchangeError`."""
    if not texts:
        return []
    from trackmark.bench.exchange.importing import guest

    guests = [guest(text) for text in texts]
    labels = [one.tracker for one in guests]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise click.UsageError(f"--results-of names {twice[0]} twice.")
    return guests


def imported(
    guests: "Sequence[Guest]", sequences: str, folder: Path, tell: Callable[[str], None] = say
) -> int:
    """Keep others' results on sequences in an experiment's folder; give the number of runs."""
    from trackmark.bench.exchange.importing import import_results, on_sequences

    on = on_sequences(chosen_sequences(sequences, None), folder)
    number = import_results(guests, on, folder, tell)
    refresh_index(folder)
    return number


@contextmanager
def together(
    experiments: Sequence[Path],
    guests: "Sequence[Guest]",
    sequences: str | None = None,
    only: Collection[str] | None = None,
) -> Iterator[list[Path]]:
    """Experiments, each with others' results in it for as long as they are looked at.

    Without experiments the others' results on `sequences` are one. `only`: names of those sequences
    of the experiments that are meant. Each run is read once.
    """
    from trackmark.bench.store.results import KeptRuns, kept_runs

    with ExitStack() as stack:
        stack.callback(kept_runs.reset, kept_runs.set(KeptRuns()))
        if not experiments:
            made = Path(stack.enter_context(TemporaryDirectory(prefix="trackmark-"))) / ALONE
            imported(guests, sequences or "", made)
            yield [made]
            return
        for experiment in experiments:
            refresh_index(experiment)
        if not guests:
            yield list(experiments)
            return
        from trackmark.bench.exchange.importing import with_guests

        yield [stack.enter_context(with_guests(one, guests, say, only)) for one in experiments]
