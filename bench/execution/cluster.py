"""Backend `dask`: gives tasks to a Dask cluster.

The cluster is started on this machine, or found by the address of its scheduler. If a Dask worker
is lost, Dask gives its task to another one. A Dask worker runs a task only if its source code
equals the command's. It returns runs to the command, which stores them.
"""

import hashlib
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, cast

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.pool import Pool
from trackmark.bench.execution.task import Limits, Task
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.external import is_external
from trackmark.bench.external.definition import with_absolute_path
from trackmark.bench.operating_system import MachineError
from trackmark.bench.store.database import ResultsError
from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import format_text
from trackmark.trackers.base.catalogue import in_file

if TYPE_CHECKING:
    from distributed import Client

_POLL_SECONDS = 2.0
_CONNECT_SECONDS = 10
_NO_WORKER_SECONDS = 300.0  # time to wait for a new worker after the last one is lost
_HOME = Path(__file__).parents[2]  # folder of all packages of trackmark
# Dask keeps a log of whole tasks in the command's memory; keep it short.
_CONFIG = {"distributed.admin.low-level-log-length": 50}


class ClusterError(ResultsError):
    """Failure of the cluster that ends the command."""


def connect(jobs: int | None, address: str | None) -> "ClusterExecutor":
    """Return the executor on a Dask cluster.

    `jobs` is the maximum number of tasks at a time; by default the number of threads of the
    cluster, or of cores of this machine. `address` is the address of the scheduler, for example
    `tcp://host:8786`. Without an address, a cluster of `jobs` processes runs on this machine until
    the work ends.

    Raises `ImportError` if Dask is not installed. Raises `ClusterError` if no scheduler answers,
    or if it has no workers.
    """
    try:
        import distributed  # noqa: F401  # check whether it is installed
    except ImportError as error:
        raise ImportError(
            f"the backend 'dask' is not installed ({error}). Install it: "
            "pip install 'trackmark[dask]'"
        ) from None
    if address is None:
        n_workers = jobs or os.cpu_count() or 1
        return ClusterExecutor(None, n_workers, 2 * n_workers)
    with _open_client(address, 0) as client:
        n_threads = _count_threads(client)
    if not n_threads:
        raise ClusterError(
            f"the Dask cluster at {address} has no worker yet. Start one, and run the same command "
            "again."
        )
    n_workers = jobs or n_threads
    # If the cluster has more threads than `jobs`, queued tasks would start immediately.
    n_queued = 2 * n_workers if n_workers >= n_threads else n_workers
    return ClusterExecutor(address, n_workers, n_queued)


@dataclass(frozen=True)
class ClusterExecutor:
    """Executor that submits tasks to a Dask cluster."""

    address: str | None  # of the scheduler; None for a cluster on this machine
    n_workers: int  # maximum number of tasks that run at a time
    n_queued: int  # maximum number of tasks in the cluster, including waiting ones

    def run_tasks(
        self, tasks: Iterable[Task], limits: Limits, progress: Callable[[int], None]
    ) -> Iterator[tuple[Task, list[Run] | SequenceError]]:
        """See `Pool.run_tasks`.

        Raises `ClusterError` if workers have other source code, or if the cluster has no worker for
        a while.
        """
        with _open_client(self.address, self.n_workers) as client:
            executor = client.get_executor(pure=False)
            run = partial(_run_task, uuid.uuid4().hex, limits, source_digest())
            remaining = iter(tasks)
            running: dict[Future[list[Run] | Exception], Task] = {}
            work = 0
            last_contact = time.monotonic()
            try:
                while True:
                    for task in islice(remaining, self.n_queued - len(running)):
                        running[executor.submit(run, with_absolute_paths(task))] = task
                    if not running:
                        return
                    ended, _ = wait(running, _POLL_SECONDS, FIRST_COMPLETED)
                    if ended or _count_threads(client):
                        last_contact = time.monotonic()
                    elif time.monotonic() - last_contact > _NO_WORKER_SECONDS:
                        raise ClusterError(
                            f"the Dask cluster has had no worker for {_NO_WORKER_SECONDS:.0f} s. "
                            "Finished runs are kept. Start workers, and run the same command "
                            "again to continue."
                        )
                    for future in ended:
                        task = running.pop(future)
                        work += task.work
                        progress(work)
                        yield task, _read_result(future, task)
            finally:
                executor.shutdown(wait=False)  # cancels tasks that have not started


_pools = threading.local()
"""Pool of each thread of a Dask worker, and the command for which it was made."""


def _run_task(command: str, limits: Limits, source: str, task: Task) -> list[Run] | Exception:
    """Run a task on a Dask worker, in a process that it starts.

    Such a process uses a processor of its own and has the limits of a local worker; threads of a
    Dask worker have neither. Errors of the sequence and of the worker are returned, because Dask
    logs raised errors. `command` identifies the command: a new command gets new processes.
    `source` is the command's `source_digest`.
    """
    if source_digest() != source:
        return ClusterError(
            f"the worker on {socket.gethostname()} has another version of trackmark's source "
            f"than this command (folder {_HOME}). Install the same version there, and restart "
            "the Dask workers."
        )
    if getattr(_pools, "command", None) != command:
        if hasattr(_pools, "pool"):
            _pools.pool.close()
        _pools.command, _pools.pool = command, Pool(1, limits)
    try:
        ((_, result),) = _pools.pool.run_tasks([task])
    except (MachineError, ResultsError) as error:
        return error
    return cast(list[Run] | Exception, result)


@cache
def source_digest() -> str:
    """Return the digest of trackmark's source at the time of the first call in this process.

    A long-lived worker keeps its imported modules, even if their files change later.
    """
    digest = hashlib.sha256()
    for package in ("bench", "datasets", "trackers"):
        for file in sorted((_HOME / package).rglob("*.py")):
            name = str(file.relative_to(_HOME))
            digest.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def with_absolute_paths(task: Task) -> Task:
    """Return the task with absolute paths, for a process with another working directory."""
    runs = tuple(run._replace(tracker=_with_absolute_path(run.tracker)) for run in task.runs)
    return replace(task, source=task.source.absolute(), runs=runs)


def _with_absolute_path(tracker: str) -> str:
    name, options = split_text(tracker)
    if is_external(name, options):
        return format_text(*with_absolute_path(name, options))
    if location := in_file(tracker):
        file, rest = location
        return f"{file.absolute()}:{rest}"
    return tracker


def _read_result(future: "Future[list[Run] | Exception]", task: Task) -> list[Run] | SequenceError:
    """Return the runs of a task, or an error that affects only this task.

    Raises `ClusterError` if no further task can run, and `MachineError` as a local worker. Any
    other exception of the task is a defect of trackmark.
    """
    from distributed import KilledWorker

    try:
        result = future.result()
    except KilledWorker as error:
        return SequenceError(
            f"{task.source.spec}: {error.allowed_failures + 1} Dask workers were lost while they "
            f"ran this sequence, the last at {error.last_worker.address}. See their logs for the "
            "reason, and run the same command again."
        )
    except (CancelledError, OSError) as error:
        raise _lost_scheduler(str(error) or "it ended, or cannot be reached") from error
    if isinstance(result, Exception) and not isinstance(result, SequenceError):
        raise result
    return result


def _count_threads(client: "Client") -> int:
    """Return the number of threads of all current workers."""
    try:
        return sum(client.nthreads().values())
    except OSError as error:
        raise _lost_scheduler(str(error)) from error


def _lost_scheduler(reason: str) -> ClusterError:
    return ClusterError(
        f"the Dask scheduler is lost: {reason}. Finished runs are kept. "
        "Start it again, and run the same command again to continue."
    )


@contextmanager
def _open_client(address: str | None, n_workers: int) -> "Iterator[Client]":
    """Connect to a running scheduler, or start a cluster on this machine."""
    from dask import config
    from distributed import Client, LocalCluster
    from distributed.comm import get_address_host

    with ExitStack() as stack:
        stack.enter_context(config.set(_CONFIG))
        if address is None:
            # Each task uses one thread. The worker process that runs the task limits its memory.
            cluster = LocalCluster(
                n_workers=n_workers, threads_per_worker=1, memory_limit=0, dashboard_address=None
            )
            stack.enter_context(cluster)
            client = Client(cluster, set_as_default=False)
        else:
            try:
                get_address_host(address)  # raises for an invalid address; a client would hang
                client = Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
            except (OSError, ValueError) as error:
                raise ClusterError(
                    f"no Dask scheduler responds at {address} ({error}). Start one, or correct "
                    "--address."
                ) from error
        yield stack.enter_context(client)
