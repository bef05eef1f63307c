"""What the engines for clusters share: how units travel, and what a worker checks before it works.

Dask and Ray hand units to workers, and to another worker where one is lost. Here is decided
how many are underway, and what an error of the cluster means for the experiment.
"""

import hashlib
import os
import socket
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Protocol, TypeAlias

from bench.engine import Job
from bench.engine.performing import Outcome
from bench.engine.unit import Unit
from bench.store.files import ResultsError, remove_file, temporary_name, write_atomically
from datasets import SequenceError
from trackers.base.catalogue import in_file

_POLL_SECONDS = 2.0
_HOME = Path(__file__).parents[2]  # what all packages of trackmark lie in

Performed: TypeAlias = Outcome | SequenceError | ResultsError
"""What comes back from a worker."""


class ClusterError(ResultsError):
    """A cluster that can't do the work; the message says why, and what to do."""


class Cluster(Protocol):
    """An open connection to workers."""

    def threads(self) -> int:
        """How many units the workers of this moment perform at once; 0 without workers.

        Raises `ClusterError` where the cluster no longer answers.
        """
        ...

    def submit(self, task: "Task", unit: Unit) -> Future[Performed]:
        """Have a worker call `task(unit)`; another one, where that worker is lost."""
        ...

    def explain(self, error: Exception, unit: Unit) -> Exception:
        """What a unit's failed future means.

        A `SequenceError` costs the unit, anything else ends the work; what the task itself
        raised is a defect of ours and given as it is.
        """
        ...


Opened: TypeAlias = AbstractContextManager[Cluster]


@dataclass(frozen=True)
class ClusterEngine:
    """An engine that hands units to a cluster; see `bench.engine.Engine`."""

    name: str  # what messages call the cluster
    workers: int  # units that are performed at once
    underway: int  # units that the cluster has at most, waiting ones among them
    open: Callable[[], Opened]  # gives the connection as a context, which ends when the work does
    patience: float = 300.0  # seconds that it waits for a new worker when the last one is lost

    def perform(
        self, units: Iterable[Unit], job: Job, progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, Outcome | Exception]]:
        """See `bench.engine.Engine.perform`.

        Raises `ClusterError` where workers can't do the work, or none is left.
        """
        folder = job.folder.absolute()
        with _marked(folder) as mark, self.open() as cluster:
            task = Task(replace(job, folder=folder), mark, source_digest())
            remaining = iter(units)
            running: dict[Future[Performed], Unit] = {}
            done = 0
            heard = time.monotonic()
            while True:
                for unit in islice(remaining, self.underway - len(running)):
                    running[cluster.submit(task, _from_anywhere(unit))] = unit
                if not running:
                    return
                ended, _ = wait(running, _POLL_SECONDS, FIRST_COMPLETED)
                if ended or cluster.threads():
                    heard = time.monotonic()
                elif time.monotonic() - heard > self.patience:
                    raise ClusterError(
                        f"{self.name} has had no worker for {self.patience:.0f} s. What is done "
                        "is kept. Start workers, and the same command goes on from there."
                    )
                for future in ended:
                    unit = running.pop(future)
                    outcome = _outcome(future, unit, cluster)
                    done += unit.work
                    progress(done)
                    yield unit, outcome


@dataclass(frozen=True)
class Task:
    """A job on its way to workers: done only where folder and source are the command's."""

    job: Job
    mark: str  # name of a file that the command keeps in the job's folder while it lasts
    source: str  # the command's `source_digest`

    def __call__(self, unit: Unit) -> Performed:
        """Perform a unit; errors of sequence and results are given, not raised.

        What is raised, a cluster would log as a defect.
        """
        try:
            self._check_place()
            return self.job(unit)
        except (SequenceError, ResultsError) as error:
            return error

    def _check_place(self) -> None:
        host = socket.gethostname()
        if not (self.job.folder / self.mark).is_file():
            raise ClusterError(
                f"the worker on {host} does not see the command's folder {self.job.folder}. "
                "Choose one with --output that all machines share, under the same path."
            )
        if source_digest() != self.source:
            raise ClusterError(
                f"the worker on {host} runs another source of trackmark than this command, from "
                f"{_HOME}. Install the same one there; a worker "
                "that was started before a change must be started again."
            )


def check_installed(library: str, extra: str) -> None:
    """Check that an engine's library is there.

    Raises `ImportError` saying what to install.
    """
    try:
        import_module(library)
    except ImportError as error:
        raise ImportError(
            f"the engine {extra!r} is not installed ({error}). "
            f"Install it: pip install 'trackmark[{extra}]'"
        ) from None


def local_engine(name: str, jobs: int | None, start: Callable[[int], Opened]) -> ClusterEngine:
    """An engine that starts a cluster of `jobs` processes, one a core by default, for its work."""
    workers = jobs or os.cpu_count() or 1
    return ClusterEngine(name, workers, 2 * workers, partial(start, workers))


def remote_engine(name: str, jobs: int | None, open_: Callable[[], Opened]) -> ClusterEngine:
    """An engine that works on a cluster which others started; on all of it by default.

    Raises `ClusterError` where it does not answer or has no workers.
    """
    with open_() as cluster:
        threads = cluster.threads()
    if not threads:
        raise ClusterError(f"{name} has no worker yet. Start one, and run the same command again.")
    workers = jobs or threads
    # On a larger cluster than was asked for nothing can wait: it would be begun at once.
    return ClusterEngine(name, workers, 2 * workers if workers >= threads else workers, open_)


@cache
def source_digest() -> str:
    """Digest of the source of what works here, as it was when this process first asked.

    Long-lived workers go on with the modules that they once imported, whatever the files hold.
    """
    digest = hashlib.sha256()
    for package in ("bench", "datasets", "trackers"):
        for file in sorted((_HOME / package).rglob("*.py")):
            name = str(file.relative_to(_HOME))
            digest.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


@contextmanager
def _marked(folder: Path) -> Iterator[str]:
    """A file in the folder by which workers know it from any other of the same path."""
    mark = temporary_name(f"command-{uuid.uuid4().hex}")
    write_atomically(folder / mark, b"Workers look for this file while a command runs.\n")
    try:
        yield mark
    finally:
        remove_file(folder / mark)


def _outcome(future: Future[Performed], unit: Unit, cluster: Cluster) -> Outcome | Exception:
    try:
        outcome = future.result()
    # Clusters raise errors of many kinds, and what tasks raise beside; `explain` knows them.
    except Exception as error:
        explained = cluster.explain(error, unit)
        if not isinstance(explained, SequenceError):
            raise explained from error
        return explained
    if isinstance(outcome, ClusterError):
        raise outcome
    return outcome


def _from_anywhere(unit: Unit) -> Unit:
    """The same unit for a process with another working directory."""
    entries = []
    for entry in unit.entries:
        place = in_file(entry.tracker)
        if place is not None:
            file, rest = place
            entry = entry._replace(tracker=f"{file.absolute()}:{rest}")
        entries.append(entry)
    return replace(unit, source=unit.source.absolute(), entries=tuple(entries))
