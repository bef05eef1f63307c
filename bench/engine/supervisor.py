"""Who keeps a child process at work, ends it when a tracker goes astray, and finds the culprit."""

import os
import pickle
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

import bench
from bench.engine.board import NOBODY, READING, Board, Sight
from bench.engine.child import Answer, EscapedError, Perform, Probe, Record
from bench.engine.limits import Limits, machine_memory
from bench.engine.output import Tail, drain
from bench.engine.probe import Probed
from bench.engine.worker import Failure, Outcome
from bench.store.files import ResultsError
from bench.unit import Unit
from bench.watch import NotAttributableError, Watch
from datasets import SequenceError

__all__ = ["Supervisor"]

_Result = TypeVar("_Result")

_POLL_SECONDS = 0.1
_START_SECONDS = 300.0


@dataclass(frozen=True)
class _Death:
    """How a child ended, or why it was ended.

    Attributes
    ----------
    reason : str
        For the failure of the culprit.
    sight : Sight
        What its board showed last.
    output : str
        What it printed last.
    outside : bool
        Whether somebody else killed it: the user, or a machine that has no memory left.
    """

    reason: str
    sight: Sight
    output: str = ""
    outside: bool = False


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
        self._child: _Child | None = None
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
            if not isinstance(ended, _Death):
                outcomes.append(ended)
            elif len(group.entries) > 1:
                groups = _suspects(group, ended.sight.entry) + groups
            elif ended.outside and not spared:
                # Once may be somebody else's doing; see `_Death.outside`.
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
        return None if isinstance(ended, _Death) else ended

    def close(self) -> None:
        """End the child, whatever it is doing."""
        self._closed = True
        if self._child is not None:
            self._child.end()

    def _record(self, unit: Unit, folder: Path, death: _Death) -> Outcome:
        frame = death.sight.frame if death.sight.calls else None
        failure = Failure(frame, death.reason, death.output)
        ended = self._ask(Record(unit, folder, failure), unit, 0, None)
        if isinstance(ended, _Death):
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
    ) -> "_Result | _Death":
        if self._child is None or not self._child.lives():
            self._child = _Child(self.limits)
        child = self._child
        answer = child.ask(request, lambda sight: _tell(progress, unit, done, sight))
        if self._closed:
            raise ClosedError
        if isinstance(answer, _Death):
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
            return _Death(str(result), known, child.tail.text())
        if isinstance(result, Exception):
            raise result
        given: _Result = result
        return given


class _Child:
    """A child process, and the ways to and from it."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        ours, theirs = socket.socketpair()
        # The file has no name: nothing is left of it, however this process ends.
        with tempfile.TemporaryFile() as shared, theirs:
            shared.truncate(Board.SIZE)
            self.board = Board(shared.fileno())
            given = [theirs.fileno(), shared.fileno()]
            memory = limits.memory_bytes or machine_memory() // (os.cpu_count() or 1)
            self._process = subprocess.Popen(  # noqa: S603  # ourselves
                [
                    *(sys.executable, "-m", "bench.engine.child"),
                    *map(str, [*given, os.getpid(), memory]),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=given,
                env=os.environ | {"PYTHONPATH": _search_path()},
                # In a session of its own it is reached by no signal that is for this command,
                # and all that it starts can be ended with it.
                start_new_session=True,
            )
            theirs.close()
            self._connection = Connection(ours.detach())
            self.tail = Tail()
            self._reader = threading.Thread(
                target=drain, args=(self._process.stdout, self.tail), daemon=True
            )
            self._reader.start()
            begun = self._hear(lambda _: None, _START_SECONDS)
        if isinstance(begun, _Death):
            self.end()
            raise ResultsError(
                f"a worker process can't begin: {begun.reason}. It said: {begun.output.strip()}"
            )

    def lives(self) -> bool:
        """Whether it can be asked."""
        return self._process.poll() is None and not self._connection.closed

    def ask(self, request: Any, look: Callable[[Sight], None]) -> "Answer | _Death":
        """Send a request and wait for the answer, or for the child's end."""
        self.board.clear()
        self.tail.clear()
        try:
            self._connection.send(request)
        except OSError:
            return self._death()
        return self._hear(look, self._limits.frame_seconds)

    def end(self) -> None:
        """Kill it, and what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._reader.join(_POLL_SECONDS)
        if not self._connection.closed:
            self._connection.close()

    def _hear(self, look: Callable[[Sight], None], limit: float) -> "Answer | _Death":
        seen = self.board.look()
        waited = 0.0
        last = time.monotonic()
        while True:
            try:
                if self._connection.poll(_POLL_SECONDS):
                    answer: Answer = self._connection.recv()
                    return answer
            except (EOFError, OSError, pickle.UnpicklingError):
                return self._death()
            if self._process.poll() is not None and not self._connection.poll(0):
                return self._death()
            now = time.monotonic()
            sight = self.board.look()
            # What this process itself slept through (stopped, suspended) does not count.
            waited += min(now - last, 2 * _POLL_SECONDS)
            last = now
            if sight.calls != seen.calls or sight.entry == NOBODY:
                waited = 0.0
            seen = sight
            look(sight)
            if waited > limit:
                if sight.entry == READING:
                    raise SequenceError(f"frame {sight.frame} could not be read within {limit:g} s")
                return _Death(f"no answer within {limit:g} s", sight, self.tail.text())

    def _death(self) -> _Death:
        """How the child ended, once it is known that it did."""
        try:
            code = self._process.wait(_POLL_SECONDS * 10)
        except subprocess.TimeoutExpired:
            code = None  # it lives, but the way to it is closed
        self._reader.join(_POLL_SECONDS * 10)
        sight = self.board.look()
        if sight.lost or code is None:
            reason = "it closed file descriptors that are not its own"
        elif code < 0:
            reason = f"its process was killed by {signal.Signals(-code).name}"
        else:
            reason = f"its process ended with status {code}"
        return _Death(reason, sight, self.tail.text(), outside=code == -signal.SIGKILL)


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
    )


def _tell(progress: Callable[[int], None] | None, unit: Unit, done: int, sight: Sight) -> None:
    if progress is not None:
        progress(done + sight.shown * len(unit.entries))


def _search_path() -> str:
    """Where the child finds these very packages."""
    home = str(Path(bench.__file__).parents[1])
    return os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
