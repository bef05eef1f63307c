"""Dask engine: runs work units on a Dask cluster.

The cluster is started on this machine, or found by the address of its scheduler. If a Dask worker
is lost, Dask gives its unit to another one. A Dask worker runs a unit only if its source code
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
from typing import TYPE_CHECKING, TypeAlias

from trackmark.bench.engine import Engine
from trackmark.bench.engine.pool import Pool
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.external.definition import is_external, with_absolute_path
from trackmark.bench.machine_errors import MachineError
from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import format_text
from trackmark.trackers.base.catalogue import in_file

if TYPE_CHECKING:
    from distributed import Client

_POLL_SECONDS = 2.0
_CONNECT_SECONDS = 10
_NO_WORKER_SECONDS = 300.0  # time to wait for a new worker after the last one is lost
_HOME = Path(__file__).parents[2]  # folder of all packages of trackmark
# Dask keeps a log of whole units in the command's memory; keep it short.
_CONFIG = {"distributed.admin.low-level-log-length": 50}

_Result: TypeAlias = list[tuple[int, Run]] | SequenceError | MachineError | ResultsError
"""Runs of a unit with the numbers of their entries, or an error."""


class ClusterError(ResultsError):
    """Failure of the cluster that ends the command."""


def connect(jobs: int | None, address: str | None) -> Engine:
    """Return the Dask engine.

    `jobs` is the maximum number of units at a time; by default the number of threads of the
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
            f"the engine 'dask' is not installed ({error}). Install it: "
            "pip install 'trackmark[dask]'"
        ) from None
    if address is None:
        workers = jobs or os.cpu_count() or 1
        return _Dask(None, workers, 2 * workers)
    with _open_client(address, 0) as client:
        threads = _count_threads(client)
    if not threads:
        raise ClusterError(
            f"the Dask cluster at {address} has no worker yet. Start one, and run the same command "
            "again."
        )
    workers = jobs or threads
    # If the cluster has more threads than `jobs`, queued units would start immediately.
    return _Dask(address, workers, 2 * workers if workers >= threads else workers)


@dataclass(frozen=True)
class _Dask:
    """Engine that submits units to a Dask cluster."""

    address: str | None  # of the scheduler; None for a cluster on this machine
    workers: int  # maximum number of units that run at a time
    queued: int  # maximum number of units in the cluster, including waiting ones

    def perform(
        self, units: Iterable[Unit], limits: Limits, progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, dict[Entry, Run] | Exception]]:
        """See `bench.engine.Engine.perform`.

        Raises `ClusterError` if workers have other source code, or if the cluster has no worker for
        a while.
        """
        with _open_client(self.address, self.workers) as client:
            executor = client.get_executor(pure=False)
            task = partial(_perform_unit, uuid.uuid4().hex, limits, source_digest())
            remaining = iter(units)
            running: dict[Future[_Result], Unit] = {}
            done = 0
            last_contact = time.monotonic()
            try:
                while True:
                    for unit in islice(remaining, self.queued - len(running)):
                        running[executor.submit(task, with_absolute_paths(unit))] = unit
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
                        unit = running.pop(future)
                        done += unit.work
                        progress(done)
                        yield unit, _read_result(future, unit)
            finally:
                executor.shutdown(wait=False)  # cancels units that have not started


_pools = threading.local()
"""Pool of each thread of a Dask worker, with the command and the limits for which it was made."""


def _perform_unit(command: str, limits: Limits, source: str, unit: Unit) -> _Result:
    """Run a unit on a Dask worker.

    Errors of the sequence and of the worker are returned, because Dask logs raised errors.
    `command` identifies the command: a new command gets new worker processes. `source` is the
    command's `source_digest`.
    """
    try:
        if source_digest() != source:
            raise ClusterError(
                f"the worker on {socket.gethostname()} has another version of trackmark's source "
                f"than this command (folder {_HOME}). Install the same version there, and restart "
                "the Dask workers."
            )
        key = command, limits
        if getattr(_pools, "key", None) != key:
            if hasattr(_pools, "pool"):
                _pools.pool.close()
            _pools.key, _pools.pool = key, Pool(limits)
        result: dict[Entry, Run] | SequenceError | MachineError | ResultsError
        ((_, result),) = _pools.pool.perform([unit])
    except (MachineError, ResultsError) as error:
        return error
    if isinstance(result, dict):  # Dask would turn the keys into tuples
        return [(unit.entries.index(entry), run) for entry, run in result.items()]
    return result


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


def with_absolute_paths(unit: Unit) -> Unit:
    """Return the unit with absolute paths, for a process with another working directory."""
    entries = []
    for entry in unit.entries:
        name, options = split_text(entry.tracker)
        if is_external(name, options):
            text = format_text(*with_absolute_path(name, options))
            entry = entry._replace(tracker=text)
        elif location := in_file(entry.tracker):
            file, rest = location
            entry = entry._replace(tracker=f"{file.absolute()}:{rest}")
        entries.append(entry)
    return replace(unit, source=unit.source.absolute(), entries=tuple(entries))


def _read_result(future: Future[_Result], unit: Unit) -> dict[Entry, Run] | Exception:
    """Return the runs of a unit, or an error that affects only this unit.

    Raises `ClusterError` if no further unit can run. Any other exception of the task is a defect of
    trackmark.
    """
    from distributed import KilledWorker

    try:
        result = future.result()
    except KilledWorker as error:
        return SequenceError(
            f"{unit.source.text}: {error.allowed_failures + 1} Dask workers were lost while they "
            f"ran this sequence, the last at {error.last_worker.address}. See their logs for the "
            "reason, and run the same command again."
        )
    except (CancelledError, OSError) as error:
        raise _lost_scheduler(str(error) or "it ended, or cannot be reached") from error
    if isinstance(result, ClusterError):
        raise result
    if isinstance(result, list):
        return {unit.entries[number]: run for number, run in result}
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
def _open_client(address: str | None, workers: int) -> "Iterator[Client]":
    """Connect to a running scheduler, or start a cluster on this machine."""
    from dask import config
    from distributed import Client, LocalCluster
    from distributed.comm import get_address_host

    with ExitStack() as stack:
        stack.enter_context(config.set(_CONFIG))
        if address is None:
            # Each unit uses one thread. The worker process that runs the unit limits its memory.
            cluster = LocalCluster(
                n_workers=workers, threads_per_worker=1, memory_limit=0, dashboard_address=None
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
