"""Units of work on a Ray cluster: one of this machine, or one that an address names."""

import os
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Any

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

_RETRIES = 3
_CONNECT_SECONDS = 10.0
_OBJECT_STORE_BYTES = 80 << 20  # hardly more than Ray demands: what comes back is small


def connect(jobs: int | None, address: str | None) -> Engine:
    """Give the engine that works on Ray.

    `jobs`: units performed at once; by default as many as the cluster has CPUs, or this machine
    cores. `address`: as `ray.init` takes it: `auto`, `host:6379`, `ray://host:10001`. Without it a
    cluster of `jobs` processes is started on this machine, and ends with the work.

    Raises `ImportError` where Ray is not installed. Raises `ClusterError` where no cluster
    answers, or it has no CPUs.
    """
    check_installed("ray", extra="ray")
    if address is not None:
        return remote_engine(f"the Ray cluster at {address}", jobs, partial(_opened, address))
    return local_engine("the local Ray cluster", jobs, _started)


class _Ray:
    """See `Cluster`."""

    def __init__(self) -> None:
        import ray

        remote = ray.remote(_perform).options(num_cpus=1, max_retries=_RETRIES)
        self._perform: Callable[[Task, Unit], Any] = remote.remote

    def threads(self) -> int:
        """See `Cluster.threads`."""
        import ray

        return int(ray.cluster_resources().get("CPU", 0))

    def submit(self, task: Task, unit: Unit) -> Future[Performed]:
        """See `Cluster.submit`."""
        future: Future[Performed] = self._perform(task, unit).future()
        return future

    def explain(self, error: Exception, unit: Unit) -> Exception:
        """See `Cluster.explain`."""
        from ray.exceptions import NodeDiedError, RayError, RayTaskError, WorkerCrashedError

        if isinstance(error, WorkerCrashedError | NodeDiedError):
            return SequenceError(
                f"{unit.source.text}: {_RETRIES + 1} Ray workers were lost one after the other "
                "while they ran it. Ray's logs say why; the same command tries again."
            )
        if isinstance(error, RayError) and not isinstance(error, RayTaskError):
            return ClusterError(
                f"the Ray cluster is lost: {_first_line(error)} What is done is kept. "
                "Start it again, and the same command goes on from there."
            )
        return error


def _perform(task: Task, unit: Unit) -> Performed:
    return task(unit)


def _started(workers: int) -> AbstractContextManager[Cluster]:
    return _opened(
        "local",
        num_cpus=workers,
        include_dashboard=False,
        object_store_memory=_OBJECT_STORE_BYTES,
    )


@contextmanager
def _opened(address: str, **options: Any) -> Iterator[Cluster]:
    import ray

    try:
        try:
            _check_somebody_there(address)
            ray.init(address, log_to_driver=False, logging_level="ERROR", **options)
        except (OSError, OverflowError, ValueError) as error:
            raise ClusterError(
                f"no Ray cluster answers at {address} ({_first_line(error)}). "
                "Start one, or mend --address."
            ) from error
        yield _Ray()
    finally:
        ray.shutdown()


def _check_somebody_there(address: str) -> None:
    """Connect to where an address says that Ray is, which itself would try for many minutes.

    Raises `OSError` where nobody listens, `OverflowError` where no port has that number.
    """
    named = os.environ.get("RAY_ADDRESS", address) if address == "auto" else address
    host, _, port = named.removeprefix("ray://").rpartition(":")
    if port.isdecimal():  # else it is not a place: `auto`, `local`
        socket.create_connection((host.strip("[]"), int(port)), _CONNECT_SECONDS).close()


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
