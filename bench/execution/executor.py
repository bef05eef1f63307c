"""Execution of an experiment: executes, stores and scores missing runs."""

import logging
import os
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run, drawing_note
from trackmark.bench.execution.plan import (
    OpenedSequences,
    Plan,
    RunStatus,
    Tasks,
    make_plan,
    missing_tasks,
)
from trackmark.bench.execution.pool import Pool
from trackmark.bench.execution.task import Limits, Task, UnusableTrackerError
from trackmark.bench.experiments.experiment import (
    Experiment,
    ExperimentError,
    SequenceSpec,
    read_experiment,
)
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs, list_runs
from trackmark.bench.store.truth import StoredTruth, stored_truth
from trackmark.datasets import SequenceError
from trackmark.datasets.interface import UnusableSequencesError
from trackmark.datasets.spec_string import name_hint
from trackmark.trackers import Randomness, TrackerError

if TYPE_CHECKING:
    from trackmark.bench.execution.cluster import ClusterExecutor

BACKENDS = ("local", "dask")
"""Names of what executes tasks: worker processes of this machine, or a Dask cluster."""


def run_experiment(
    experiment: Experiment | str | Path,
    output: str | Path = "results",
    jobs: int | None = None,
    *,
    retry_failed: bool = False,
    backend: str = "local",
    address: str | None = None,
    limits: Limits | None = None,
) -> Path:
    """Execute the missing runs of an experiment.

    Parameters
    ----------
    experiment : Experiment, str or Path
        Experiment, or its name or TOML file for `read_experiment`.
    output : str or Path
        Results folder; the experiment gets a subfolder of its name.
    jobs : int, optional
        Number of worker processes; one per core by default.
    retry_failed : bool
        Whether failed runs are repeated.
    backend : {'local', 'dask'}
        What executes the runs: this machine, or a Dask cluster.
    address : str, optional
        Scheduler of a running Dask cluster.
    limits : Limits, optional
        Limits of time and memory of a tracker.

    Returns
    -------
    Path
        The experiment's folder, for `load_runs`.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ResultsError
        If a part of the experiment cannot be executed. Finished runs stay stored.
    """
    if not isinstance(experiment, Experiment):
        experiment = read_experiment(experiment)
    execution = Execution(
        experiment,
        Path(output),
        jobs,
        retry_failed=retry_failed,
        backend=backend,
        address=address,
        limits=limits or Limits(),
    )
    for _ in execution.rows():
        pass
    execution.raise_errors()
    return execution.folder


@dataclass
class Execution:
    """Execution of an experiment.

    `folder` is the folder of the results. `plan` holds the statuses of the runs before the
    execution.
    """

    experiment: Experiment  # this field and the next six are parameters of `run_experiment`
    results_root: Path  # `output` there
    jobs: int | None = None
    retry_failed: bool = False
    backend: str = "local"
    address: str | None = None
    limits: Limits = field(default_factory=Limits)
    opened_sequences: OpenedSequences = field(default_factory=dict)  # by other plans
    progress: Callable[[int, int], None] = lambda *_: None  # see `make_plan`
    # message on each sequence that could not be read, by its specification
    errors: dict[str, str] = field(default_factory=dict)
    tracker_errors: list[str] = field(default_factory=list)  # of workers, each once
    on_error: Callable[[str], None] = lambda _: None  # called with such a message at once

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            hint = name_hint(self.backend, BACKENDS)
            raise ExperimentError(f"unknown backend {self.backend!r}.{hint}")
        if self.address is not None and self.backend != "dask":
            raise ExperimentError(
                "--address is only valid with --backend dask. Omit it, or add --backend dask."
            )
        self.folder = self.results_root / self.experiment.name
        self._run_store = RunStore(self.folder)
        self.plan: Plan = make_plan(
            self.experiment,
            self._run_store,
            self.opened_sequences,
            self.progress,
            self.jobs or os.cpu_count() or 1,
        )
        self._truths: dict[tuple[SequenceSpec, str], StoredTruth] = {}

    @cached_property
    def cluster(self) -> "ClusterExecutor | None":
        """Dask cluster that executes the tasks; None for workers of this machine.

        Raises `ImportError`, whose message contains the remedy, if Dask is not installed.
        """
        if self.backend == "local":
            return None
        from trackmark.bench.execution import cluster

        return cluster.connect(self._max_tasks, self.address)

    @property
    def _max_tasks(self) -> int | None:
        """Maximum number of tasks at a time; one if runs depend on the time of updates."""
        return 1 if self.experiment.time_dependent else self.jobs

    @cached_property
    def n_workers(self) -> int:
        """Number of tasks that are executed at the same time."""
        if self.cluster is not None:
            return self.cluster.n_workers
        return self._max_tasks or os.cpu_count() or 1

    @cached_property
    def tasks(self) -> Tasks:
        """Tasks of the missing runs."""
        return missing_tasks(self.plan, n_workers=self.n_workers, retry_failed=self.retry_failed)

    def rows(self, progress: Callable[[int], None] = lambda _: None) -> Iterator[dict[str, Any]]:
        """Execute the missing runs; yield the row of each stored run.

        If a run shows that its tracker is stochastic, its other repetitions follow; then `plan` and
        `tasks` change. `progress` gets the work done so far, also that of former tasks.

        Raises `ResultsError` if results cannot be written.
        """
        work = 0
        while True:
            title = self.experiment.title or self.experiment.name
            self._run_store.add_requests(self.plan.requested, title)
            if not self.tasks.n_runs:
                return
            drew = yield from self._execute(progress, work)
            work += self.tasks.work
            if not drew:
                return
            before, self.plan = self.plan, self.plan.with_stored(list_runs(self.folder))
            if len(self.plan) == len(before):
                return
            new = [key not in before.requested for key in self.plan.requested]
            requested = np.array(new).reshape(self.plan.statuses.shape) & (
                self.plan.statuses <= RunStatus.STALE
            )
            self.tasks = Tasks(self.plan, requested, self.n_workers)

    def _execute(
        self, progress: Callable[[int], None], work_before: int
    ) -> Generator[dict[str, Any], None, set[str]]:
        """Execute the present tasks; yield the row of each stored run.

        Returns the deterministic trackers that drew from global generators.
        """
        drew: set[str] = set()
        for task, result in self._run_tasks(lambda work: progress(work_before + work)):
            try:
                if isinstance(result, SequenceError):
                    raise result
                rows = self._store(task, result)
            except UnusableTrackerError as error:
                if str(error) not in self.tracker_errors:
                    self.tracker_errors.append(str(error))
                continue
            except SequenceError as error:
                if task.source.spec not in self.errors:
                    self.on_error(str(error))
                self.errors.setdefault(task.source.spec, str(error))
                continue
            self._report_drawing(rows, drew)
            yield from rows
        return drew

    def _run_tasks(
        self, progress: Callable[[int], None]
    ) -> Iterator[tuple[Task, list[Run] | SequenceError]]:
        """Yield the present tasks with their runs as they end; see `Pool.run_tasks`."""
        if self.cluster is not None:
            yield from self.cluster.run_tasks(self.tasks, self.limits, progress)
        else:
            with closing(Pool(self.n_workers, self.limits)) as pool:
                yield from pool.run_tasks(self.tasks, progress)

    def _report_drawing(self, rows: list[dict[str, Any]], reported: set[str]) -> None:
        """Log which deterministic trackers of the plan drew from global generators, once each."""
        for row in rows:
            if not row["generators"] or row["tracker"] in reported:
                continue
            specs = {spec.label: spec for spec in self.plan.trackers.values()}
            if specs[row["tracker"]].randomness is Randomness.NONE:
                reported.add(row["tracker"])
                note = drawing_note(row["tracker"], row["generators"])
                logging.getLogger("trackmark").warning(note)

    def raise_errors(self) -> None:
        """Raise one error if trackers could not be created, or if sequences could not be read."""
        if not (self.errors or self.tracker_errors):
            return
        unusable = UnusableSequencesError(self.errors, len(self.plan.sequences))
        if not self.tracker_errors:
            raise unusable
        lines = [*self.tracker_errors, *([str(unusable)] if self.errors else [])]
        raise TrackerError("\n".join(lines))

    def _store(self, task: Task, runs: list[Run]) -> list[dict[str, Any]]:
        """Store and score the runs of a task; return their rows."""
        source = task.source.absolute()
        key = task.source, task.runs[0].identity.fingerprint
        if key not in self._truths:
            sequence = datasets.load(source.spec, truth=source.truth)
            self._truths[task.source, sequence.fingerprint] = stored_truth(sequence)
        if key not in self._truths:
            raise SequenceError(
                f"{task.source.spec}: the sequence changed during its runs, which were not stored. "
                "Run the same command again."
            )
        origin = {"source": source.spec, "truth": str(source.truth or "")}
        complete = []
        for run, planned in zip(runs, task.runs, strict=True):
            complete.append((replace(run, metadata={**run.metadata, **origin}), planned.replaces))
        # The ground truth is written with every task: another process can have removed it. A run
        # that another process has stored in the meantime is kept.
        added = self._run_store.add_all(complete, [self._truths[key]])
        rows = [row for row in added if row is not None]
        if len(rows) < len(added):  # stored by another process
            kept_keys = {run_key(run.identity) for run in runs} - {run_key(row) for row in rows}
            all_rows = Runs.open(self.folder).stored_rows
            rows += [row for row in all_rows if run_key(row) in kept_keys]
        return rows
