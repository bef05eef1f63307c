"""Engines: where units of work are performed, and what keeps a bad tracker from harming others.

An engine is a file here that offers `connect(jobs, address)`. It hands units to a `Job`, which
performs each in a child process of the place where it is called: of this command, or of a
worker of a cluster.
"""

import importlib
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from trackmark.bench.engine.unit import Limits, Unit
from trackmark.bench.experiments.experiment import ExperimentError

if TYPE_CHECKING:
    from trackmark.bench.engine.performing import Outcome, Probed
from trackmark.datasets.spec_string import close_match

__all__ = ["ENGINES", "Engine", "Job", "engine", "probe"]

ENGINES = ("local", "dask")
"""Names of the engines."""

_HERE = threading.local()


@dataclass(frozen=True)
class Job:
    """What a worker needs to know to perform units of an experiment. It can be pickled."""

    folder: Path  # the experiment's folder of results, the same for all workers
    limits: Limits = field(default_factory=Limits)
    # Which command it is for. Workers outlive commands; the children of one, with the trackers that
    # they have imported, must not perform the units of the next.
    command: str = field(default_factory=lambda: uuid.uuid4().hex)

    def __call__(self, unit: Unit) -> "Outcome":
        """Perform a unit under the supervisor of the calling thread, which is kept.

        Raises `SequenceError`, `ResultsError` as `bench.engine.performing.perform`.
        """
        from trackmark.bench.engine.supervisor import Supervisor

        mine: tuple[Job, Supervisor] | None = getattr(_HERE, "mine", None)
        if mine is None or mine[0] != self:
            if mine is not None:
                mine[1].close()
            mine = _HERE.mine = self, Supervisor(self.limits)
        return mine[1].perform(unit, self.folder)


class Engine(Protocol):
    """Where units are performed."""

    @property
    def workers(self) -> int:
        """How many units are performed at once."""
        ...

    def perform(
        self, units: Iterable[Unit], job: Job, progress: Callable[[int], None]
    ) -> "Iterator[tuple[Unit, Outcome | Exception]]":
        """Perform units, in any order.

        `units` are consumed as the work goes on; `progress` is called now and then with the work
        (`Unit.work`) done so far. Units come with their outcomes as they end. An exception is one
        of the sequence or of the results: what is wrong with trackers is recorded in their runs.
        """
        ...


def probe(unit: Unit, frames: int, limits: Limits) -> "Probed | None":
    """See `Supervisor.probe`; nothing else is done by that supervisor."""
    from trackmark.bench.engine.supervisor import Supervisor

    supervisor = Supervisor(limits)
    try:
        return supervisor.probe(unit, frames)
    finally:
        supervisor.close()


def engine(name: str = "local", *, jobs: int | None = None, address: str | None = None) -> Engine:
    """Give an engine.

    `name`: one of `ENGINES`. `jobs`: units performed at once; by default as many as there are
    cores. `address`: of a running cluster.

    Raises `ExperimentError` for an unknown name, or an address that the engine has no use for.
    Raises `ImportError` where its library is not installed, with what to install.
    """
    if name not in ENGINES:
        hint = close_match(name, ENGINES)
        raise ExperimentError(f"unknown engine {name!r}.{hint} Known: {', '.join(ENGINES)}.")
    found: Engine = importlib.import_module(f"trackmark.bench.engine.{name}").connect(jobs, address)
    return found
