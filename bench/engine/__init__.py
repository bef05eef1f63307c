"""Engines: run work units on this machine (`pool.py`) or on a Dask cluster (`dask.py`).

Both engines run each unit in a worker process of a `Pool`, which attributes failures to trackers.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Protocol

from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.datasets.spec_string import name_hint

__all__ = ["ENGINES", "Engine", "engine"]

ENGINES = ("local", "dask")
"""Names of the engines."""


class Engine(Protocol):
    """Interface of an engine, which runs work units."""

    @property
    def workers(self) -> int:
        """Maximum number of units that run at the same time."""
        ...

    def perform(
        self, units: Iterable[Unit], limits: Limits, progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, dict[Entry, Run] | Exception]]:
        """Yield units with their runs as they end, in any order.

        `units` is consumed while the work proceeds. `progress` is called repeatedly with the work
        (`Unit.work`) that is done. An exception instead of runs is an error of the sequence;
        errors of trackers are stored in their runs.
        """
        ...


@dataclass(frozen=True)
class _Local:
    """Engine of this machine."""

    workers: int

    def perform(
        self, units: Iterable[Unit], limits: Limits, progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, dict[Entry, Run] | Exception]]:
        """See `Engine`."""
        from trackmark.bench.engine.pool import Pool

        with closing(Pool(limits, self.workers)) as pool:
            yield from pool.perform(units, progress)


def engine(name: str = "local", *, jobs: int | None = None, address: str | None = None) -> Engine:
    """Return an engine.

    `name` is one of `ENGINES`. `jobs` is the maximum number of units at a time; by default the
    number of cores. `address` is the address of a running Dask cluster.

    Raises `ExperimentError` for an unknown name, or if an address is given to the local engine.
    Raises `ImportError`, whose message contains the remedy, if Dask is not installed.
    """
    if name not in ENGINES:
        raise ExperimentError(f"unknown engine {name!r}.{name_hint(name, ENGINES)}")
    if name == "dask":
        from trackmark.bench.engine import dask

        return dask.connect(jobs, address)
    if address is not None:
        raise ExperimentError(
            "--address is only valid with --engine dask. Omit it, or add --engine dask."
        )
    return _Local(jobs or os.cpu_count() or 1)
