"""Units of work on all cores, by processes; a worker that dies costs one run."""

import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path

import numpy as np
from loky import ProcessPoolExecutor
from loky.process_executor import TerminatedWorkerError

from bench.plan import Unit
from bench.worker import Outcome, perform, prepare_worker, record_death

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
        are recorded in their runs. A unit whose process died is repeated one run a
        process, and the run that does it again is recorded as failed.
    """
    with tempfile.TemporaryDirectory(prefix="trackmark-") as scratch:
        board = Path(scratch) / "progress"
        total = sum(unit.work for unit in units)
        np.memmap(board, np.int64, "w+", shape=(max(1, len(units)),)).flush()
        done = 0

        def show(running: int) -> None:
            if progress is not None:
                progress(min(done + running, total))

        suspects: list[Unit] = []
        for unit, outcome in _attempt(units, folder, jobs, board, show):
            if isinstance(outcome, TerminatedWorkerError):
                suspects += unit.split()
                continue
            done += unit.work
            yield unit, outcome
        for unit in suspects:
            for _, outcome in _attempt([unit], folder, 1, board, show):
                if isinstance(outcome, TerminatedWorkerError):
                    reason = f"its process died: {str(outcome).splitlines()[0]}"
                    outcome = record_death(unit, folder, reason)
                done += unit.work
                yield unit, outcome


def _attempt(
    units: Iterable[Unit],
    folder: Path,
    jobs: int,
    board: Path,
    show: Callable[[int], None],
) -> Iterator[tuple[Unit, Outcome | Exception]]:
    """Perform units in one pool of processes."""
    executor = ProcessPoolExecutor(max_workers=jobs, initializer=prepare_worker)
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
                counters[number] = 0
                error = future.exception()
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

    def progress(frames: int) -> None:
        counters[number] = frames * len(unit.entries)

    return perform(unit, folder, progress)
