"""Backends: what executes tasks. `local` uses this machine, `dask` a Dask cluster.

Both give tasks to workers of a `Pool`, which repeats the tasks that end a worker.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.task import Limits, Task
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import name_hint

if TYPE_CHECKING:
    from trackmark.bench.execution.cluster import ClusterExecutor

BACKENDS = ("local", "dask")
"""Names of the backends."""


Executor: TypeAlias = "LocalExecutor | ClusterExecutor"
"""Object that executes tasks; see `LocalExecutor`."""


@dataclass(frozen=True)
class LocalExecutor:
    """Executor on this machine, with at most `n_workers` tasks at the same time."""

    n_workers: int

    def run_tasks(
        self, tasks: Iterable[Task], limits: Limits, progress: Callable[[int], None]
    ) -> Iterator[tuple[Task, list[Run] | SequenceError]]:
        """Yield tasks with their runs as they end, in any order.

        `tasks` is consumed while the work proceeds. `progress` is called repeatedly with the work
        (`Task.work`) that is done. An exception instead of runs is an error of the sequence;
        errors of trackers are stored in their runs.
        """
        from trackmark.bench.execution.pool import Pool

        with closing(Pool(self.n_workers, limits)) as pool:
            yield from pool.run_tasks(tasks, progress)


def create_executor(
    backend: str = "local", *, jobs: int | None = None, address: str | None = None
) -> Executor:
    """Return the executor of a backend.

    `backend` is one of `BACKENDS`. `jobs` is the maximum number of tasks at a time; by default the
    number of cores. `address` is the address of a running Dask cluster.

    Raises `ExperimentError` for an unknown name, or if an address is given to the local backend.
    Raises `ImportError`, whose message contains the remedy, if Dask is not installed.
    """
    if backend not in BACKENDS:
        raise ExperimentError(f"unknown backend {backend!r}.{name_hint(backend, BACKENDS)}")
    if backend == "dask":
        from trackmark.bench.execution import cluster

        return cluster.connect(jobs, address)
    if address is not None:
        raise ExperimentError(
            "--address is only valid with --backend dask. Omit it, or add --backend dask."
        )
    return LocalExecutor(jobs or os.cpu_count() or 1)
