"""Work units of the missing runs of a plan, created one after another."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, zip_longest
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.engine.work_unit import Entry, Unit
from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.experiments.tracker_spec import TrackerSpec, planned_values, run_identity
from trackmark.trackers import Randomness


class _Group(NamedTuple):
    """Runs that may share a process."""

    owner: str  # see `Unit`
    alone: bool  # whether each run has its own unit
    runs: NDArray[np.bool_]  # True for the runs of the group, shape (runs on a sequence,)


@dataclass(frozen=True, eq=False)
class Units:
    """Work units of a plan, created one after another.

    A process runs a single tracker if the tracker uses global random generators, is timed, or is
    not part of the package. The units of these trackers come first. Within a group of runs that may
    share a process, the longest sequences come first, so that no worker finishes much later than
    the others. A unit has at most one worker's share of the total work, unless it has a single run.
    The last sequences, which are fewer than the workers, are split among all workers.
    """

    plan: Plan
    wanted: NDArray[np.bool_]  # runs to execute, shape (sequences, runs on a sequence)
    workers: int  # number of units that are executed at the same time

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.wanted.sum())

    @property
    def work(self) -> int:
        """Total work: frames times trackers."""
        return int((self.wanted.sum(axis=1) * self.plan.frames).sum())

    def __len__(self) -> int:
        return sum(
            int(np.minimum(self._parts(group), (self.wanted & group.runs).sum(axis=1)).sum())
            for group in self._groups
        )

    def __iter__(self) -> Iterator[Unit]:
        by_group = map(self._group_units, self._groups)
        if not self.plan.experiment.timing:
            yield from chain.from_iterable(by_group)
            return
        # Timed trackers take turns, so that slow changes of the machine affect all of them.
        for turn in zip_longest(*by_group):
            yield from filter(None, turn)

    def _group_units(self, group: _Group) -> Iterator[Unit]:
        """Yield the units of a group; the longest sequences come first."""
        wanted = self.wanted & group.runs
        parts = self._parts(group)
        work = self.plan.frames * wanted.sum(axis=1)
        for sequence in np.argsort(-work, kind="stable")[: np.count_nonzero(work)].tolist():
            runs = np.flatnonzero(wanted[sequence]).tolist()
            whole = self._unit(sequence, runs, group.owner)
            yield from whole.split(int(parts[sequence]))

    @cached_property
    def _groups(self) -> list[_Group]:
        """Runs that may share a process; those of the package's trackers come last."""
        time_dependent = self.plan.experiment.time_dependent
        keys = [
            (
                spec.label if time_dependent else owner_of(spec),
                # Trackers in processes of their own would run several processes at a time.
                time_dependent or spec.randomness is Randomness.PROCESS or spec.call_seconds > 0,
            )
            for spec in self.plan.trackers.values()
        ]
        return [
            _Group(*key, np.array([other == key for other in keys])[self.plan.run_trackers])
            for key in sorted(dict.fromkeys(keys), key=lambda key: key == ("", False))
        ]

    def _parts(self, group: _Group) -> NDArray[np.int64]:
        """Return the number of units of each sequence."""
        runs: NDArray[np.int64] = (self.wanted & group.runs).sum(axis=1)
        if group.alone:
            return runs
        most = np.maximum(self.work // (self.workers * self.plan.frames), 1)
        parts: NDArray[np.int64] = -(-runs // most)
        # The last sequences are split among all workers, so that no worker waits.
        longest_first = np.argsort(-self.plan.frames * runs, kind="stable")
        busy = longest_first[: np.count_nonzero(runs)]
        last = busy[len(busy) - len(busy) % self.workers :]
        parts[last] = np.maximum(parts[last], self.workers)
        return parts

    def _unit(self, sequence: int, runs: list[int], owner: str) -> Unit:
        plan, planned = self.plan, self.plan.sequences[sequence]
        texts = list(plan.trackers)
        entries = []
        for run in runs:
            tracker, repetition = int(plan.run_trackers[run]), int(plan.run_repetitions[run])
            text = texts[tracker]
            cell = plan.trackers[text].label, planned.name, repetition, plan.protocol
            replaced, _ = plan.stored.get(cell, ("", ""))
            identity = run_identity(plan.trackers[text], planned, repetition, plan.protocol)
            values = json.dumps(planned_values(identity))
            version = plan.versions[sequence][tracker]
            entries.append(Entry(text, repetition, version, replaced, values))
        arrays, frames = plan.experiment.arrays, planned.frames
        return Unit(
            planned.source,
            tuple(entries),
            plan.protocol,
            frames,
            owner,
            arrays,
            planned.fingerprint,
            max(plan.trackers[entry.tracker].call_seconds for entry in entries),
        )


def owner_of(spec: TrackerSpec) -> str:
    """Return file and name of a tracker outside the package, which gets its own process.

    The text is empty for the package's trackers, which do not change the state of the process.
    """
    return "" if spec.is_built_in else f"{spec.file}:{spec.name}"


def missing_units(plan: Plan, *, workers: int = 1, retry_failed: bool = False) -> Units:
    """Return the work units of the missing runs of a plan.

    `workers` is the number of units that run at the same time. `retry_failed` is whether failed
    runs count as missing.
    """
    return Units(plan, plan.states <= (State.FAILED if retry_failed else State.DISTURBED), workers)
