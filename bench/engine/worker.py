"""What a worker process does: one unit of work, from opening the sequence to the files."""

import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import datasets
from bench.contestant import contestant, identify
from bench.evaluation import run_in_lock_step
from bench.record import Run
from bench.reference import reference
from bench.store.index import index_row
from bench.store.results import Results
from bench.store.truth import write_truth
from bench.timing import time_run
from bench.unit import Unit
from datasets import Sequence, SequenceError

__all__ = ["Outcome", "perform", "prepare_worker", "record_death"]

_PARENT_SECONDS = 1.0


@dataclass(frozen=True)
class Outcome:
    """What became of a unit.

    Attributes
    ----------
    rows : list of dict
        The index's rows of its runs, which lie on disk.
    overhead : float
        The harness's own seconds per frame and tracker; NaN in timing runs.
    """

    rows: list[dict[str, Any]]
    overhead: float


def prepare_worker(parent: int) -> None:
    """Set up a worker of the process `parent`: Ctrl-C is its business, one thread each."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: nobody waits for what it would still do."""
    while os.getppid() == parent:
        time.sleep(_PARENT_SECONDS)
    os._exit(1)


def perform(unit: Unit, folder: Path, progress: Callable[[int], None] | None = None) -> Outcome:
    """Run a unit and write its runs.

    Raises
    ------
    SequenceError
        Where the sequence can't be read to its end; none of the unit's runs is written.
    ResultsError
        Where the results can't be written.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = {text: contestant(text) for text, *_ in unit.entries}
    entries = [(chosen[text], repetition) for text, repetition, *_ in unit.entries]
    _check_unchanged(unit)
    overhead = float("nan")
    if unit.protocol == "timing":
        runs = [time_run(*entry, sequence, progress=progress) for entry in entries]
    else:
        passed = run_in_lock_step(entries, sequence, progress=progress)
        runs, overhead = passed.runs, passed.overhead
    _check_unchanged(unit)
    runs = [replace(run, circumstances={"overhead": overhead}) for run in runs]
    return Outcome(_store(runs, unit, sequence, Results(folder)), overhead)


def record_death(unit: Unit, folder: Path, reason: str) -> Outcome:
    """Write the only run of a unit as failed: its process died and could not do so itself."""
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    ((text, repetition, *_),) = unit.entries
    n = len(sequence)
    boxes = np.full((n, 4), np.nan)
    chosen = contestant(text)
    given = reference(sequence, chosen.init, sequence.name).boxes
    boxes[sequence.first_frame] = given[sequence.first_frame]
    run = Run(
        identity=identify(chosen, sequence, repetition, unit.protocol),
        boxes=boxes,
        visible=np.zeros(n, np.bool_),
        confidence=np.full(n, np.nan),
        failure=reason,
    )
    return Outcome(_store([run], unit, sequence, Results(folder)), float("nan"))


def _store(
    runs: list[Run], unit: Unit, sequence: Sequence, results: Results
) -> list[dict[str, Any]]:
    write_truth(results.folder, sequence)
    origin = unit.source.absolute()
    source = {"source": origin.text, "truth": str(origin.truth or "")}
    rows = []
    for run, entry in zip(runs, unit.entries, strict=True):
        told = replace(run, circumstances={**run.circumstances, **source})
        path = results.path(told.identity)
        if not results.write(told, entry.replaces):
            told = results.read(path)  # another process was quicker: its run stands
        rows.append(index_row(results, path, told, sequence))
    return rows


def _check_unchanged(unit: Unit) -> None:
    """Check that trackers and sequence are still what was planned.

    Asked before the pass and after it: boxes of one version must never be kept as another's.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = {text: contestant(text) for text, *_ in unit.entries}
    for text, repetition, planned, _ in unit.entries:
        key = identify(chosen[text], sequence, repetition, unit.protocol)
        if key.version != planned:
            raise SequenceError(
                f"{key.tracker} on {key.sequence}: the tracker or the sequence changed while it "
                "ran, so nothing was kept. Run the same command again."
            )
