"""What is left of a plan as units of work, made one after another as they are asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.engine.unit import Entry, Unit
from bench.execution.plan import Plan, State
from trackers import Randomness

__all__ = ["Units", "left_of"]


@dataclass(frozen=True, eq=False)
class Units:
    """Units of a plan, made one after another as they are asked for.

    Trackers whose random numbers live in the process never share one with others; they come
    first, since they are the slow ones. Then come sequences, the longest first: no core waits
    at the end for a long one that began late. No unit is larger than the share of one worker,
    unless it holds a single run; and the sequences of a last round, which are fewer than there
    are workers, are split among all of them.
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
        alone = self.wanted & self._alone
        shared = (self.wanted & ~self._alone).sum(axis=1)
        return int(alone.sum() + np.minimum(self._parts(shared), shared).sum())

    def __iter__(self) -> Iterator[Unit]:
        frames = self.plan.frames
        alone, shared = self.wanted & self._alone, self.wanted & ~self._alone
        for sequence in np.argsort(-frames, kind="stable").tolist():
            for run in np.flatnonzero(alone[sequence]).tolist():
                yield self._unit(sequence, [run])
        parts = self._parts(shared.sum(axis=1))
        for sequence in np.argsort(-frames * shared.sum(axis=1), kind="stable").tolist():
            runs = np.flatnonzero(shared[sequence]).tolist()
            if runs:
                yield from self._unit(sequence, runs).split(int(parts[sequence]))

    @cached_property
    def _alone(self) -> NDArray[np.bool_]:
        """Whether a run on a sequence has its process to itself."""
        chosen = self.plan.trackers.values()
        apart = [entry.randomness is Randomness.PROCESS for entry in chosen]
        return np.array(apart)[self.plan.run_trackers] | self.plan.experiment.timing

    def _parts(self, runs: NDArray[np.int64]) -> NDArray[np.int64]:
        """Into how many units the runs of each sequence go."""
        most = np.maximum(self.work // (self.workers * self.plan.frames), 1)
        parts = -(-runs // most)
        # What is left over for a last round goes to all workers: else some would only wait.
        longest_first = np.argsort(-self.plan.frames * runs, kind="stable")
        busy = longest_first[: np.count_nonzero(runs)]
        last = busy[len(busy) - len(busy) % self.workers :]
        parts[last] = np.maximum(parts[last], self.workers)
        return parts

    def _unit(self, sequence: int, runs: list[int]) -> Unit:
        plan = self.plan
        texts = list(plan.trackers)
        entries = []
        for run in runs:
            tracker = int(plan.run_trackers[run])
            replaced = int(plan.replaced[sequence, run])
            entries.append(
                Entry(
                    texts[tracker],
                    int(plan.run_repetitions[run]),
                    plan.versions[sequence, tracker].decode(),
                    "" if replaced < 0 else plan.replaced_versions[replaced].as_py(),
                )
            )
        found = plan.sequences[sequence]
        return Unit(found.source, tuple(entries), plan.protocol, found.frames)


def left_of(plan: Plan, *, workers: int = 1, retry_failed: bool = False) -> Units:
    """What is left to do of a plan.

    `plan`: with the states of its runs. `workers`: how many units are performed at once.
    `retry_failed`: whether runs that failed are left to do, too.
    """
    return Units(plan, plan.states <= (State.FAILED if retry_failed else State.STALE), workers)
