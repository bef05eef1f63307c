"""Units of work on a Dask cluster: one of this machine, or one that a scheduler's address names."""

from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

from bench.engine import Engine
from bench.engine.cluster import (
    Cluster,
    ClusterError,
    Performed,
    Task,
    check_installed,
    local_engine,
    remote_engine,
)
from bench.engine.unit import Unit
from datasets import SequenceError

if TYPE_CHECKING:
    from distributed import Client
    from distributed.cfexecutor import ClientExecutor

_CONNECT_SECONDS = 10
# Dask's logs of messages keep whole units: in the command, they shall be few.
_SHORT_LOGS = {"distributed.admin.low-level-log-length": 50}


def connect(jobs: int | None, address: str | None) -> Engine:
    """Give the engine that works on Dask.

    `jobs`: units performed at once; by default as many as the cluster has threads, or this machine
    cores. `address`: a scheduler's (`tcp://host:8786`). Without it a cluster of `jobs` processes is
    started on this machine, and ends with the work.

    Raises `ImportError` where Dask is not installed. Raises `ClusterError` where no scheduler
    answers, or it has no workers.
    """
    check_installed("distributed", extra="dask")
    if address is None:
        return local_engine("the local Dask cluster", jobs, _started)
    return remote_engine(f"the Dask cluster at {address}", jobs, partial(_connected, address))


class _Dask:
    """See `Cluster`."""

    def __init__(self, client: "Client", executor: "ClientExecutor") -> None:
        self._client = client
        self._executor = executor

    def threads(self) -> int:
        """See `Cluster.threads`."""
        try:
            return sum(self._client.nthreads().values())
        except OSError as error:
            raise _lost(str(error)) from error

    def submit(self, task: Task, unit: Unit) -> Future[Performed]:
        """See `Cluster.submit`."""
        future: Future[Performed] = self._executor.submit(task, unit)
        return future

    def explain(self, error: Exception, unit: Unit) -> Exception:
        """See `Cluster.explain`."""
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            return SequenceError(
                f"{unit.source.text}: {error.allowed_failures + 1} Dask workers were lost one "
                f"after the other while they ran it, the last at {error.last_worker.address}. "
                "Their logs say why; the same command tries again."
            )
        if isinstance(error, CancelledError | OSError):
            return _lost(str(error) or "it ended, or can't be reached")
        return error


@contextmanager
def _started(workers: int) -> Iterator[Cluster]:
    from dask import config
    from distributed import Client, LocalCluster

    # A unit is one thread, and its memory is bounded where it is performed, in a child.
    with (
        config.set(_SHORT_LOGS),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, memory_limit=0, dashboard_address=None
        ) as local,
        Client(local, set_as_default=False) as client,
        _working(client) as cluster,
    ):
        yield cluster


@contextmanager
def _connected(address: str) -> Iterator[Cluster]:
    from dask import config
    from distributed import Client
    from distributed.comm import get_address_host

    try:
        get_address_host(address)  # a client that has no known kind of address never closes
        with config.set(_SHORT_LOGS):
            client = Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"no Dask scheduler answers at {address} ({error}). Start one, or mend --address."
        ) from error
    with client, _working(client) as cluster:
        yield cluster


@contextmanager
def _working(client: "Client") -> Iterator[Cluster]:
    executor = client.get_executor(pure=False)
    try:
        yield _Dask(client, executor)
    finally:
        executor.shutdown(wait=False)  # what is still waiting there is not begun


def _lost(reason: str) -> ClusterError:
    return ClusterError(
        f"the Dask scheduler is lost: {reason}. What is done is kept. "
        "Start it again, and the same command goes on from there."
    )
