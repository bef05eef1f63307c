"""Units of work on all cores, by processes; a worker that dies costs one run."""

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path

import numpy as np
from loky import ProcessPoolExecutor
from loky.process_executor import TerminatedWorkerError

from bench.engine.worker import Outcome, perform, prepare_worker, record_death
from bench.unit import Unit

__all__ = ["execute"]

_POLL_SECONDS = 0.2


def execute(
    units: list[Unit],
    folder: Path,
    jobs: int,
    progress: Callable[[int], None] | None = None,
) -> Iterator[tuple[Unit, Outcome | Exception]]:
    """Perform units in worker processes, in any order.

    Parameters
    ----------
    units : list of Unit
        What to do.
    folder : Path
        The experiment's folder of results.
    jobs : int
        Worker processes.
    progress : callable, optional
        Called now and then with the work done so far, in frames times trackers.

    Yields
    ------
    unit, outcome
        As they end. An exception is one of the sequence or of the results: trackers' own
        are recorded in their runs. Where a process died, the units that were running are
        repeated alone, then one run a process; the run that does it again is recorded as
        failed. The others go on as before.
    """
    with tempfile.TemporaryDirectory(prefix="trackmark-") as scratch:
        board = Path(scratch) / "progress"
        np.memmap(board, np.int64, "w+", shape=(max(1, len(units)),)).flush()
        done = 0

        def show(running: int) -> None:
            if progress is not None:
                progress(done + running)

        suspects: list[Unit] = []
        todo = units
        while todo:
            begun: list[Unit] = []
            again: list[Unit] = []
            for unit, outcome in _attempt(todo, folder, jobs, board, show):
                if isinstance(outcome, _NotBegunError):
                    again.append(unit)
                elif isinstance(outcome, TerminatedWorkerError):
                    begun.append(unit)
                else:
                    done += unit.work
                    yield unit, outcome
            if again and not begun:
                raise RuntimeError("the worker processes die before they begin any work")
            suspects += begun
            todo = again
        while suspects:
            unit = suspects.pop(0)
            ((_, outcome),) = _attempt([unit], folder, 1, board, show)
            if isinstance(outcome, TerminatedWorkerError):
                if len(unit.entries) > 1:
                    suspects = unit.split(len(unit.entries)) + suspects
                    continue
                reason = f"its process died: {str(outcome).splitlines()[0]}"
                outcome = record_death(unit, folder, reason)
            done += unit.work
            yield unit, outcome


class _NotBegunError(Exception):
    """A unit that was waiting when its pool broke."""


def _attempt(
    units: Iterable[Unit],
    folder: Path,
    jobs: int,
    board: Path,
    show: Callable[[int], None],
) -> Iterator[tuple[Unit, Outcome | Exception]]:
    """Perform units in one pool of processes."""
    executor = ProcessPoolExecutor(
        max_workers=jobs, initializer=prepare_worker, initargs=(os.getpid(),)
    )
    try:
        futures: dict[Future[Outcome], tuple[int, Unit]] = {
            executor.submit(_perform, number, unit, folder, board): (number, unit)
            for number, unit in enumerate(units)
        }
        counters = np.memmap(board, np.int64, "r+")
        counters[:] = 0
        waiting = set(futures)
        while waiting:
            ended, waiting = wait(waiting, _POLL_SECONDS, FIRST_COMPLETED)
            for future in ended:
                number, unit = futures[future]
                begun = counters[number] > 0
                counters[number] = 0
                error = future.exception()
                if isinstance(error, TerminatedWorkerError) and not begun:
                    error = _NotBegunError()
                if error is not None and not isinstance(error, Exception):
                    raise error
                yield unit, future.result() if error is None else error
            show(int(counters.sum()))
    finally:
        # Also on Ctrl-C and when the consumer stops early: nothing runs on unattended.
        executor.shutdown(wait=True, kill_workers=True)


def _perform(number: int, unit: Unit, folder: Path, board: Path) -> Outcome:
    """`perform` in a worker, with its progress on the board."""
    counters = np.memmap(board, np.int64, "r+")
    counters[number] = 1  # it has begun

    def progress(frames: int) -> None:
        counters[number] = frames * len(unit.entries)

    return perform(unit, folder, progress)
