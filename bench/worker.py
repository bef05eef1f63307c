"""What a worker process does: one unit of work, from opening the sequence to the files."""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import datasets
from bench.contestant import contestant, identify
from bench.evaluation import run_in_lock_step
from bench.index import index_row
from bench.plan import Unit
from bench.record import Run
from bench.results import Results
from bench.stored_truth import write_truth
from bench.timing import time_run
from datasets import Sequence

__all__ = ["Outcome", "perform", "prepare_worker", "record_death"]


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


def prepare_worker() -> None:
    """Set up a worker process: Ctrl-C is the parent's business, one thread a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)


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
    entries = [(contestant(text), repetition) for text, repetition in unit.entries]
    overhead = float("nan")
    if unit.protocol == "timing":
        runs = [time_run(*entry, sequence, progress=progress) for entry in entries]
    else:
        passed = run_in_lock_step(entries, sequence, progress=progress)
        runs, overhead = passed.runs, passed.overhead
    return Outcome(_store(runs, sequence, Results(folder), {"overhead": overhead}), overhead)


def record_death(unit: Unit, folder: Path, reason: str) -> Outcome:
    """Write the only run of a unit as failed: its process died and could not do so itself."""
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    ((text, repetition),) = unit.entries
    n = len(sequence)
    boxes = np.full((n, 4), np.nan)
    boxes[sequence.first_frame] = sequence.boxes[sequence.first_frame]
    run = Run(
        identity=identify(contestant(text), sequence, repetition, unit.protocol),
        boxes=boxes,
        visible=np.zeros(n, np.bool_),
        confidence=np.full(n, np.nan),
        failure=reason,
    )
    return Outcome(_store([run], sequence, Results(folder), {}), float("nan"))


def _store(
    runs: list[Run], sequence: Sequence, results: Results, circumstances: dict[str, Any]
) -> list[dict[str, Any]]:
    write_truth(results.folder, sequence)
    return [index_row(results, results.write(run, circumstances), run, sequence) for run in runs]
