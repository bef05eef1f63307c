"""What is left of a plan as units of work, made one after another as they are asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.engine.work_unit import Entry, Unit
from trackmark.bench.execution.plan import Plan, State
from trackmark.bench.experiments.tracker_spec import PACKAGE, Contestant
from trackmark.trackers import Randomness


class _Group(NamedTuple):
    """Runs that may share a process."""

    owner: str  # see `Unit`
    alone: bool  # whether each has a unit to itself
    runs: NDArray[np.bool_]  # which they are, shape (runs on a sequence,)


@dataclass(frozen=True, eq=False)
class Units:
    """Units of a plan, made one after another as they are asked for.

    Trackers whose random numbers live in the process never share one with others; nor do
    trackers that are timed, or that are none of the package: what such a one does to its process
    must not show in others. These come first, one after the other. Within a group that may share
    a process come sequences, the longest first: no core waits at the end for a long one that began
    late. No unit is larger than the share of one worker, unless it holds a single run; and the
    sequences of a last round, which are fewer than there are workers, are split among all of them.
    """

    plan: Plan
    wanted: NDArray[np.bool_]  # which of them, shape (sequences, runs on a sequence)
    workers: int  # how many units are performed at once

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.wanted.sum())

    @property
    def work(self) -> int:
        """Frames times trackers."""
        return int((self.wanted.sum(axis=1) * self.plan.frames).sum())

    def __len__(self) -> int:
        return sum(
            int(np.minimum(self._parts(group), (self.wanted & group.runs).sum(axis=1)).sum())
            for group in self._groups
        )

    def __iter__(self) -> Iterator[Unit]:
        for group in self._groups:
            wanted = self.wanted & group.runs
            parts = self._parts(group)
            work = self.plan.frames * wanted.sum(axis=1)
            for sequence in np.argsort(-work, kind="stable")[: np.count_nonzero(work)].tolist():
                runs = np.flatnonzero(wanted[sequence]).tolist()
                whole = self._unit(sequence, runs, group.owner)
                yield from whole.split(int(parts[sequence]))

    @cached_property
    def _groups(self) -> list[_Group]:
        """Runs by what may share a process; those of the package's trackers come last."""
        clocked = self.plan.experiment.clocked
        keys = [
            (
                chosen.label if clocked else owner_of(chosen),
                clocked or chosen.randomness is Randomness.PROCESS,
            )
            for chosen in self.plan.trackers.values()
        ]
        of = self.plan.run_trackers
        return [
            _Group(*key, np.array([other == key for other in keys])[of])
            for key in sorted(dict.fromkeys(keys), key=lambda key: key == ("", False))
        ]

    def _parts(self, group: _Group) -> NDArray[np.int64]:
        """Into how many units the runs of each sequence go."""
        runs: NDArray[np.int64] = (self.wanted & group.runs).sum(axis=1)
        if group.alone:
            return runs
        most = np.maximum(self.work // (self.workers * self.plan.frames), 1)
        parts: NDArray[np.int64] = -(-runs // most)
        # What is left over for a last round goes to all workers: else some would only wait.
        longest_first = np.argsort(-self.plan.frames * runs, kind="stable")
        busy = longest_first[: np.count_nonzero(runs)]
        last = busy[len(busy) - len(busy) % self.workers :]
        parts[last] = np.maximum(parts[last], self.workers)
        return parts

    def _unit(self, sequence: int, runs: list[int], owner: str) -> Unit:
        plan = self.plan
        texts = list(plan.trackers)
        found = plan.sequences[sequence]
        entries = []
        for run in runs:
            tracker, repetition = int(plan.run_trackers[run]), int(plan.run_repetitions[run])
            text = texts[tracker]
            cell = plan.trackers[text].label, found.name, repetition, plan.protocol
            replaced, _ = plan.stored.get(cell, ("", ""))
            entries.append(Entry(text, repetition, plan.versions[sequence][tracker], replaced))
        arrays = plan.experiment.arrays
        return Unit(
            found.source,
            tuple(entries),
            plan.protocol,
            found.frames,
            owner,
            arrays,
            found.fingerprint,
        )


def owner_of(chosen: Contestant) -> str:
    """Who has the process of a tracker to itself: a tracker that is none of the package.

    Empty for the others, whose source is ours: they leave to others what is the process's.
    """
    if chosen.file is not None and chosen.file.parent == PACKAGE:
        return ""
    return f"{chosen.file}:{chosen.name}"


def left_of(plan: Plan, *, workers: int = 1, retry_failed: bool = False) -> Units:
    """What is left to do of a plan.

    `plan`: with the states of its runs. `workers`: how many units are performed at once.
    `retry_failed`: whether runs that failed are left to do, too.
    """
    return Units(plan, plan.states <= (State.FAILED if retry_failed else State.STALE), workers)
