"""Tasks of the missing runs of a plan, created one after another."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.execution.plan import Plan, RunStatus
from trackmark.bench.execution.task import PlannedRun, Task
from trackmark.bench.experiments.tracker_spec import run_identity

MAX_TRACKER_PROCESSES = 4
"""Maximum number of runs of a task whose trackers have processes of their own.

The processes of a task exist at the same time, and each can hold a model in memory.
"""


@dataclass(frozen=True, eq=False)
class Tasks:
    """Tasks of a plan, created one after another.

    The longest sequences come first, so that no worker finishes much later than the others. A task
    has at most one worker's share of the total work, unless it has a single run. The last
    sequences, which are fewer than the workers, are split among all workers. If results depend on
    time, each run has its own task, and trackers take turns: slow changes of the machine then
    affect all of them.
    """

    plan: Plan
    requested: NDArray[np.bool_]  # runs to execute, shape (sequences, runs on a sequence)
    n_workers: int  # number of tasks that are executed at the same time

    @property
    def n_runs(self) -> int:
        """Number of runs."""
        return int(self.requested.sum())

    @property
    def work(self) -> int:
        """Total work: frames times trackers."""
        return int(self._work_by_sequence.sum())

    def __len__(self) -> int:
        return int(self._n_parts.sum())

    def __iter__(self) -> Iterator[Task]:
        longest_first = np.argsort(-self._work_by_sequence, kind="stable")
        for sequence in longest_first[: np.count_nonzero(self._work_by_sequence)].tolist():
            runs = np.flatnonzero(self.requested[sequence])
            if self.plan.experiment.time_dependent:
                runs = runs[np.argsort(self.plan.run_repetitions[runs], kind="stable")]
            n_parts = int(self._n_parts[sequence])
            for offset in range(n_parts):
                # Neighbouring runs are of the same tracker, and are equally likely to be slow.
                yield self._task(sequence, runs[offset::n_parts].tolist())

    @cached_property
    def _work_by_sequence(self) -> NDArray[np.int64]:
        return np.asarray(self.plan.n_frames * self.requested.sum(axis=1), np.int64)

    @cached_property
    def _n_parts(self) -> NDArray[np.int64]:
        """Number of tasks of each sequence."""
        n_runs: NDArray[np.int64] = self.requested.sum(axis=1)
        if self.plan.experiment.time_dependent:
            return n_runs
        max_runs = np.maximum(self.work // (self.n_workers * self.plan.n_frames), 1)
        n_parts: NDArray[np.int64] = -(-n_runs // max_runs)
        # The last sequences are split among all workers, so that no worker waits.
        busy = np.argsort(-self._work_by_sequence, kind="stable")[: np.count_nonzero(n_runs)]
        last = busy[len(busy) - len(busy) % self.n_workers :]
        n_parts[last] = np.maximum(n_parts[last], self.n_workers)
        isolated = np.array([spec.is_isolated for spec in self.plan.trackers.values()])
        n_isolated = (self.requested & isolated[self.plan.run_trackers]).sum(axis=1)
        n_parts = np.maximum(n_parts, -(-n_isolated // MAX_TRACKER_PROCESSES))
        return np.asarray(np.minimum(n_parts, n_runs), np.int64)

    def _task(self, sequence: int, runs: list[int]) -> Task:
        plan, planned = self.plan, self.plan.sequences[sequence]
        specs, protocol = list(plan.trackers), plan.experiment.protocol_key
        planned_runs = []
        for run in runs:
            spec = specs[plan.run_trackers[run]]
            repetition = int(plan.run_repetitions[run])
            identity = run_identity(plan.trackers[spec], planned, repetition, protocol)
            key = identity.tracker, planned.name, repetition, protocol
            version, _ = plan.stored_versions.get(key, ("", RunStatus.MISSING))
            planned_runs.append(PlannedRun(spec, identity, version))
        arrays = plan.experiment.keeps_arrays
        return Task(planned.source, tuple(planned_runs), planned.n_frames, keep_arrays=arrays)


def missing_tasks(plan: Plan, *, n_workers: int = 1, retry_failed: bool = False) -> Tasks:
    """Return the tasks of the missing runs of a plan.

    `n_workers` is the number of tasks that run at the same time. `retry_failed` is whether failed
    runs count as missing.
    """
    highest = RunStatus.FAILED if retry_failed else RunStatus.DISTURBED
    return Tasks(plan, plan.statuses <= highest, n_workers)
