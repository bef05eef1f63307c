"""Who keeps a child process at work, ends it when a tracker goes astray, and finds the culprit."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from bench.engine.board import NOBODY, READING, Sight
from bench.engine.child import EscapedError, Perform, Probe, Record
from bench.engine.child_process import ChildProcess, Death
from bench.engine.limits import Limits
from bench.engine.probe import Probed
from bench.engine.worker import Failure, Outcome
from bench.unit import Unit
from bench.watch import NotAttributableError, Watch
from datasets import SequenceError

__all__ = ["Supervisor"]

_Result = TypeVar("_Result")


class ClosedError(Exception):
    """The supervisor was closed while it was at work."""


class Supervisor:
    """Performs units, each in a child process that outlives it when all goes well.

    Parameters
    ----------
    limits : Limits
        What a tracker may take.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._child: ChildProcess | None = None
        self._closed = False

    def perform(
        self, unit: Unit, folder: Path, progress: Callable[[int], None] | None = None
    ) -> Outcome:
        """Perform a unit. A tracker that kills or stops its process costs its own run alone.

        When a child dies, the run that it was at is repeated alone, and those of the others
        together. Where nobody can tell which run it was at, halves of them are repeated. What
        dies alone is recorded as failed.

        Parameters
        ----------
        unit : Unit
            What to do.
        folder : Path
            The experiment's folder of results.
        progress : callable, optional
            Called now and then with the work done so far.

        Raises
        ------
        SequenceError, ResultsError
            As `bench.engine.worker.perform`.
        """
        groups = [unit]
        outcomes: list[Outcome] = []
        spared = False
        while groups:
            group = groups.pop(0)
            done = unit.frames * sum(len(outcome.rows) for outcome in outcomes)
            ended = self._ask(Perform(group, folder, self.limits), group, done, progress)
            if not isinstance(ended, Death):
                outcomes.append(ended)
            elif ended.stalled and ended.sight.entry == READING:
                raise SequenceError(
                    f"{unit.source.text}: frame {ended.sight.frame} could not be read within "
                    f"{self.limits.frame_seconds:g} s."
                )
            elif len(group.entries) > 1:
                groups = _suspects(group, ended.sight.entry) + groups
            elif ended.outside and not spared:
                # Once may be somebody else's doing; see `Death.outside`.
                spared = True
                groups.insert(0, group)
            else:
                outcomes.append(self._record(group, folder, ended))
        return _together(outcomes)

    def probe(self, unit: Unit, frames: int) -> Probed | None:
        """Find out how long a unit's trackers take for a frame.

        Returns
        -------
        Probed or None
            None where one of them stopped or killed the process.

        Raises
        ------
        SequenceError
            Where the sequence can't be read.
        """
        ended = self._ask(Probe(unit, frames), unit, 0, None)
        return None if isinstance(ended, Death) else ended

    def close(self) -> None:
        """End the child, whatever it is doing."""
        self._closed = True
        if self._child is not None:
            self._child.end()

    def _record(self, unit: Unit, folder: Path, death: Death) -> Outcome:
        frame = death.sight.frame if death.sight.calls else None
        failure = Failure(frame, death.reason, death.output)
        ended = self._ask(Record(unit, folder, failure), unit, 0, None)
        if isinstance(ended, Death):
            raise SequenceError(
                f"{unit.source.text}: the process dies when it opens the sequence or the tracker "
                f"{unit.entries[0].tracker}: {ended.reason}."
            )
        return ended

    def _ask(
        self,
        request: Callable[[Watch], _Result],
        unit: Unit,
        done: int,
        progress: Callable[[int], None] | None,
    ) -> "_Result | Death":
        if self._child is None or not self._child.lives():
            self._child = ChildProcess(self.limits)
        child = self._child
        answer = child.ask(request, lambda sight: _tell(progress, unit, done, sight))
        if self._closed:
            raise ClosedError
        if isinstance(answer, Death):
            child.end()
            self._child = None
            return answer
        if answer.worn:
            child.end()
            self._child = None
        result = answer.result
        if isinstance(result, EscapedError | NotAttributableError):
            sight = child.board.look()
            child.end()
            self._child = None
            # Nobody can tell which one needed so much memory, or changed what they share.
            known = sight if isinstance(result, EscapedError) else sight._replace(entry=NOBODY)
            return Death(str(result), known, child.tail.text())
        if isinstance(result, Exception):
            raise result
        given: _Result = result
        return given


def _suspects(unit: Unit, entry: int) -> list[Unit]:
    """Units by which the culprit can be told from the others."""
    if entry < 0:
        return unit.split(2)
    others = unit.entries[:entry] + unit.entries[entry + 1 :]
    return [replace(unit, entries=(unit.entries[entry],)), replace(unit, entries=others)]


def _together(outcomes: list[Outcome]) -> Outcome:
    """Outcomes of a unit's parts as one."""
    if len(outcomes) == 1:
        return outcomes[0]
    return replace(
        outcomes[-1],
        rows=[row for outcome in outcomes for row in outcome.rows],
        overhead=float("nan"),  # of parts that were repeated it means little
        seconds=sum(outcome.seconds for outcome in outcomes),
        cpu_seconds=sum(outcome.cpu_seconds for outcome in outcomes),
        peak_memory=max(outcome.peak_memory for outcome in outcomes),
        errors=[error for outcome in outcomes for error in outcome.errors],
    )


def _tell(progress: Callable[[int], None] | None, unit: Unit, done: int, sight: Sight) -> None:
    if progress is not None:
        progress(done + sight.shown * len(unit.entries))
