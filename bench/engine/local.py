"""Units of work on the cores of this machine: a supervisor a core, each with its own child."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from itertools import islice

from trackmark.bench.engine import Engine, Job
from trackmark.bench.engine.performing import Outcome
from trackmark.bench.engine.supervisor import Supervisor
from trackmark.bench.engine.unit import Unit
from trackmark.bench.experiments.experiment import ExperimentError

_POLL_SECONDS = 0.2


def connect(jobs: int | None, address: str | None) -> Engine:
    """Give the engine of this machine.

    `jobs`: worker processes; as many as there are cores by default. `address`: there is none to
    give.

    Raises `ExperimentError` where there is an address.
    """
    if address is not None:
        raise ExperimentError("--address needs --engine dask; the local engine has no address.")
    return _Local(jobs or os.cpu_count() or 1)


@dataclass(frozen=True)
class _Local:
    workers: int

    def perform(
        self, units: Iterable[Unit], job: Job, progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, Outcome | Exception]]:
        """See `Engine`."""
        remaining = iter(units)
        idle = [Supervisor(job.limits) for _ in range(self.workers)]
        running: dict[Future[Outcome], tuple[Unit, Supervisor]] = {}
        partly: dict[Supervisor, int] = {}
        done = 0
        with ThreadPoolExecutor(self.workers) as pool:
            try:
                while True:
                    for unit in islice(remaining, len(idle)):
                        supervisor = idle.pop()
                        note = partial(partly.__setitem__, supervisor)
                        future = pool.submit(supervisor.perform, unit, job.folder, note)
                        running[future] = unit, supervisor
                    if not running:
                        return
                    ended, _ = wait(running, _POLL_SECONDS, FIRST_COMPLETED)
                    for future in ended:
                        unit, supervisor = running.pop(future)
                        partly.pop(supervisor, None)
                        idle.append(supervisor)
                        done += unit.work
                        error = future.exception()
                        if error is not None and not isinstance(error, Exception):
                            raise error
                        yield unit, future.result() if error is None else error
                    progress(done + sum(list(partly.values())))
            finally:
                # Also on Ctrl-C and when the consumer stops early: nothing runs on unattended.
                for supervisor in [*idle, *(busy for _, busy in running.values())]:
                    supervisor.close()
