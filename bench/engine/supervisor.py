"""Who keeps a child process at work, ends it when a tracker goes astray, and finds the culprit."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from trackmark import datasets
from trackmark.bench.engine.board import NOBODY, READING, Sight, Slot
from trackmark.bench.engine.child import DefectError, Perform, Probe, Record
from trackmark.bench.engine.child_process import ChildProcess, Death, StartError
from trackmark.bench.engine.performing import Failure, Outcome, Probed, scored
from trackmark.bench.engine.unit import Entry, Limits, Unit
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.truth import write_truth
from trackmark.datasets import SequenceError

_Result = TypeVar("_Result", Outcome, Probed)

_ERRORS = {kind.__name__: kind for kind in (SequenceError, ResultsError, DefectError)}
_NOWHERE = Sight(*(0,) * len(Slot))._replace(entry=NOBODY)

_complete = set[Path]()
"""Files of ground truth that this process has checked or written. They need no open sequence."""


class ClosedError(Exception):
    """The supervisor was closed while it was at work."""


class Supervisor:
    """Performs units, each in a child process that outlives it when all goes well.

    A child is kept for the next unit of the same owner; see `Unit`. Truth is written and runs are
    scored here, where no tracker has run.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._child: ChildProcess | None = None
        self._owner = ""  # of the units that the child has performed
        self._closed = False
        self._lock = threading.Lock()

    def perform(
        self, unit: Unit, folder: Path, progress: Callable[[int], None] | None = None
    ) -> Outcome:
        """Perform a unit. A tracker that kills or stops its process costs its own run alone.

        When a child dies, the run that it was at is repeated alone, and those of the others
        together. Where nobody can tell which run it was at, halves of them are repeated. A run
        that failed among others is repeated alone too: they may have been the cause. What fails
        alone, in a child that has done nothing else, is the culprit.

        `unit`: what to do. `folder`: the experiment's folder of results. `progress`: called now and
        then with the work done so far.

        Raises `SequenceError`, `ResultsError` as `bench.engine.performing.perform`.
        """
        truth = folder / unit.truth
        if truth not in _complete or not truth.is_file():
            write_truth(folder, datasets.load(unit.source.text, truth=unit.source.truth))
            _complete.add(truth)
        if unit.owner != self._owner:
            self._end_child()
            self._owner = unit.owner
        parts = [_Part(unit)]
        outcomes: list[Outcome] = []
        spared: set[Entry] = set()
        confirmed: set[tuple[str, str]] = set()
        while parts:
            part = parts.pop(0)
            (entry, *others) = part.unit.entries
            if part.said and (entry.tracker, part.said) in confirmed:
                continue
            fresh = part.alone or self._child is None or not self._child.used
            if part.alone:
                self._end_child()
            done = unit.frames * len(_rows(outcomes))
            ended = self._runs(Perform(part.unit, folder, self.limits), done, progress)
            if isinstance(ended, Outcome):
                outcomes.append(ended)
                parts = _failed(part.unit, ended) + parts if others else parts
                if part.said:
                    confirmed |= {(entry.tracker, said) for said in _reasons(ended)}
            elif ended.stalled and ended.sight.entry == READING:
                raise SequenceError(
                    f"{unit.source.text}: frame {ended.sight.frame} could not be read: "
                    f"{ended.reason}."
                )
            elif others:
                parts = _suspects(part.unit, ended.sight.entry) + parts
            elif not fresh:
                parts.insert(0, _Part(part.unit, alone=True))
            elif ended.outside and entry not in spared:
                # Once may be somebody else's doing; see `Death.outside`.
                spared.add(entry)
                parts.insert(0, _Part(part.unit, alone=True))
            else:
                outcomes.append(self._record(part.unit, folder, ended))
        return _together(outcomes)

    def probe(self, unit: Unit, frames: int) -> Probed | None:
        """Find out how long a unit's trackers take for a frame.

        None where one of them stopped or killed the process, or answered for it.

        Raises `SequenceError` where the sequence can't be read.
        """
        ended = self._ask(Probe(unit, frames), Probed, 0, None)
        if isinstance(ended, Death) or len(ended.seconds) != len(unit.entries):
            return None
        return ended

    def close(self) -> None:
        """End the child, whatever it is doing."""
        self._closed = True
        with self._lock:  # a child that is just made is ended, too
            self._end_child()

    def _record(self, unit: Unit, folder: Path, death: Death) -> Outcome:
        frame = death.sight.frame if death.sight.calls else None
        failure = Failure(frame, death.reason, death.output, death.stack)
        ended = self._runs(Record(unit, folder, failure), 0, None)
        if isinstance(ended, Death):
            raise SequenceError(
                f"{unit.source.text}: the process dies when it opens the sequence or the tracker "
                f"{unit.entries[0].tracker}: {ended.reason}."
            )
        return ended

    def _runs(
        self, request: Perform | Record, done: int, progress: Callable[[int], None] | None
    ) -> Outcome | Death:
        """Ask for runs, and score what has come of it."""
        ended = self._ask(request, Outcome, done, progress)
        if isinstance(ended, Death):
            return ended
        try:
            return scored(ended, request.unit, request.folder)
        except ResultsError as error:
            if isinstance(request, Record):
                raise SequenceError(f"{request.unit.source.text}: {error}") from error
            self._end_child()
            return Death(f"what it has left can't be read: {error}", _NOWHERE)

    def _ask(
        self,
        request: Perform | Record | Probe,
        kind: type[_Result],
        done: int,
        progress: Callable[[int], None] | None,
    ) -> _Result | Death:
        with self._lock:
            self._go_on()
            if self._child is None or not self._child.lives():
                self._end_child()  # what it has started may live
                self._child = self._new_child()
            child = self._child

        def look(sight: Sight) -> None:
            self._go_on()
            if progress is not None:
                progress(done + sight.shown * len(request.unit.entries))

        answer = child.ask(request, look)
        self._go_on()
        if isinstance(answer, Death) or answer.worn:
            self._end_child()
        if isinstance(answer, Death):
            return answer
        # A tracker from outside may say so in its process's name: it must not end the command.
        believed = answer.raised != DefectError.__name__ or not request.unit.owner
        if answer.raised in _ERRORS and believed:
            raise _ERRORS[answer.raised](answer.said)
        if isinstance(answer.result, kind):
            return answer.result
        self._end_child()
        sight = child.board.look()
        if answer.raised != "escaped":
            # Nobody can tell which one needed so much memory, or changed what they share.
            sight = sight._replace(entry=NOBODY)
        return Death(answer.said or "it answers for its process", sight, child.tail.text())

    def _new_child(self) -> ChildProcess:
        try:
            return ChildProcess(self.limits, self._go_on)
        except StartError:  # once more: somebody may have killed it
            return ChildProcess(self.limits, self._go_on)

    def _end_child(self) -> None:
        if self._child is not None:
            self._child.end()
            self._child = None

    def _go_on(self) -> None:
        if self._closed:
            raise ClosedError


@dataclass(frozen=True)
class _Part:
    """Some of a unit's runs."""

    unit: Unit
    alone: bool = False  # whether they must have a child that has done nothing else
    said: str = ""  # why the only run failed when others ran beside it; empty where it did not


def _failed(unit: Unit, outcome: Outcome) -> list[_Part]:
    """Runs that failed beside others, to be repeated alone.

    Of several that one tracker failed for one reason the first that does so alone will do.
    """
    parts = []
    for entry, row in zip(outcome.entries, outcome.rows, strict=True):
        if row["status"] == "failed":
            again = replace(unit, entries=(entry._replace(replaces=entry.version),))
            said = row["failure"].partition("\n")[0]
            parts.append(_Part(again, alone=True, said=said))
    return parts


def _reasons(outcome: Outcome) -> set[str]:
    """First lines of what failed runs say."""
    return {row["failure"].partition("\n")[0] for row in outcome.rows} - {""}


def _suspects(unit: Unit, entry: int) -> list[_Part]:
    """Parts by which the culprit can be told from the others."""
    if entry < 0:
        return [_Part(half) for half in unit.split(2)]
    others = unit.entries[:entry] + unit.entries[entry + 1 :]
    suspect = replace(unit, entries=(unit.entries[entry],))
    return [_Part(suspect, alone=True), _Part(replace(unit, entries=others))]


def _rows(outcomes: list[Outcome]) -> dict[str, dict[str, Any]]:
    """Rows of the runs, by path; of one that was repeated the last."""
    return {row["path"]: row for outcome in outcomes for row in outcome.rows}


def _together(outcomes: list[Outcome]) -> Outcome:
    """Outcomes of a unit's parts as one."""
    if len(outcomes) == 1:
        return outcomes[0]
    entries = {
        row["path"]: entry
        for outcome in outcomes
        for row, entry in zip(outcome.rows, outcome.entries, strict=True)
    }
    return replace(
        outcomes[-1],
        rows=list(_rows(outcomes).values()),
        entries=list(entries.values()),
        overhead=float("nan"),  # of parts that were repeated it means little
        seconds=sum(outcome.seconds for outcome in outcomes),
        cpu_seconds=sum(outcome.cpu_seconds for outcome in outcomes),
        peak_memory=max(outcome.peak_memory for outcome in outcomes),
        errors=[error for outcome in outcomes for error in outcome.errors],
    )
