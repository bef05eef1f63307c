"""Stored runs of an experiment with their ground truth and their sequences."""

from collections.abc import Iterable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeAlias

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING
from trackmark.bench.store.data_frames import ordered_rows
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, read_truth

StoredRun: TypeAlias = tuple[Mapping[str, Any], Run, StoredTruth]
"""Row of the index, run, and the ground truth of the run."""


def one_pass_runs(folder: Path, **only: str) -> Iterator[StoredRun]:
    """Yield the one-pass runs of an experiment; `only`: required values of columns."""
    return judged_runs(folder, protocol=STORED_ONE_PASS, **only)


def judged_runs(folder: Path, **only: str) -> Iterator[StoredRun]:
    """Yield the runs of an experiment by all protocols except timing, without stale runs."""
    rows = ordered_rows(Results(folder), **only)
    return read_runs(folder, (row for row in rows if is_judged(row)))


def is_judged(row: Mapping[str, Any]) -> bool:
    """Return whether a row of the index is of a run whose boxes are shown and scored."""
    return bool(row["protocol"] != TIMING and row["status"] != "stale")


def read_runs(folder: Path, rows: Iterable[Mapping[str, Any]]) -> Iterator[StoredRun]:
    """Yield the runs of rows of the index."""
    results, truth = Results(folder), cache(partial(read_truth, folder))
    for row in rows:
        yield row, results.read(run_key(row)), truth(row["sequence"], row["fingerprint"])


def open_sequence(row: Mapping[Any, Any]) -> datasets.Sequence | str:
    """Open the sequence of a row of the index; return a message if that fails."""
    name, source = row["sequence"], row["source"]
    try:
        sequence = datasets.load(source, truth=row["truth"] or None)
    except datasets.SequenceError:
        return f"{name} cannot be opened at {source}."
    if sequence.fingerprint != row["fingerprint"]:
        return f"{name} at {source} has changed since the run."
    return sequence
