"""Pool of worker processes: starts, watches and ends them, and finds trackers that do harm.

The local engine and each thread of a Dask worker has a pool. Everything runs in one thread: `Pool`
waits for its workers' bytes and looks at their heartbeats between.
"""

import fcntl
import os
import pickle
import select
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from math import nan
from typing import IO, Any, TypeAlias

from trackmark.bench.engine import heartbeat
from trackmark.bench.engine.heartbeat import READING, STARTING, NoRoomError, Sight
from trackmark.bench.engine.process_state import machine_memory
from trackmark.bench.engine.stack_trace import FATAL_SIGNALS, CodeLine, parse_stack
from trackmark.bench.engine.work_unit import (
    Entry,
    Failure,
    Limits,
    Outcome,
    Probed,
    Request,
    Unit,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.numba_compilation import announce
from trackmark.bench.process_tree import ProcessTree
from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError

_POLL_SECONDS = 0.1
_ABORT_SECONDS = 5.0  # time in which an aborted process writes its stack trace
_LONGEST_TRACE = 1 << 17  # bytes; `faulthandler` limits a stack to 100 lines
_LONGEST_OUTPUT = 1 << 14  # bytes that are kept of what a worker prints
_MAX_OUTPUT = 1 << 20  # bytes of its file
_CUT_OFF = "its process closed or overwrote file descriptors that are not its own"
# No tracker affects how long a process takes to start, a sequence to open, or a frame to read.
_LONG_SECONDS = {READING: 300.0, STARTING: 300.0, heartbeat.ELSEWHERE: 3600.0}


_Answer: TypeAlias = Outcome | Probed | Failure
_Steps: TypeAlias = Generator[Request, _Answer, Any]


class Worker:
    """A worker process, seen by its parent."""

    def __init__(self, limits: Limits) -> None:
        self._frame_seconds = limits.frame_seconds
        self._used = False
        self._worn = False  # whether trackers have left threads in it
        self._shared, self._output, self._trace = (_unnamed_file() for _ in range(3))
        fcntl.fcntl(self._output, fcntl.F_SETFL, os.O_APPEND)  # also after it was truncated
        self.channel, theirs = socket.socketpair()
        memory = limits.memory_bytes or machine_memory() // (os.cpu_count() or 1)
        descriptors = [theirs.fileno(), self._shared.fileno(), self._trace.fileno()]
        self._offspring = ProcessTree(
            "trackmark.bench.engine.worker",
            [*descriptors, os.getpid(), memory],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            pass_fds=descriptors,
        )
        self._process = self._offspring.process
        theirs.close()

    @property
    def waits(self) -> bool:
        """True if it can be given a request: it lives, and has written nothing since its answer."""
        silent = not select.select([self.channel], [], [], 0)[0]
        return self._process.poll() is None and silent and not self._worn

    def give(self, request: Request) -> None:
        """Send a request; raises `NoRoomError` if there is no room for it."""
        entry = heartbeat.ELSEWHERE if self._used else STARTING
        self._used = True
        heartbeat.reset(self._shared.fileno(), entry, pickle.dumps(request))
        self._output.truncate(0)
        self._sight, self._waited, self._last = self.look(), 0.0, time.monotonic()
        with suppress(OSError):  # `check` notices that the worker has ended
            self.channel.send(b".")

    def look(self) -> Sight:
        """Return the present values of its heartbeat."""
        return heartbeat.look(self._shared.fileno())

    def check(self, ready: bool) -> "_Answer | None":
        """Return the answer or the end of the worker; None as long as it works.

        `ready`: whether the channel can be read. Raises `SequenceError` of the worker, and
        `RuntimeError` for a defect of trackmark.
        """
        if self.look().compiled:
            announce()
        if ready:
            with suppress(OSError):
                if byte := self.channel.recv(1):
                    return self._read_answer() if byte == b"." else self._dead(_CUT_OFF)
            return self._death()
        if self._process.poll() is not None:
            return None if select.select([self.channel], [], [], 0)[0] else self._death()
        if os.fstat(self._output.fileno()).st_size > _MAX_OUTPUT:
            text = self._read_output()
            self._output.truncate(0)
            self._output.write(text.encode())
        sight, now = self.look(), time.monotonic()
        # Time in which this process itself was stopped does not count.
        self._waited += min(now - self._last, 2 * _POLL_SECONDS)
        self._last = now
        if sight.sign_of_life != self._sight.sign_of_life:
            self._waited = 0.0
        self._sight = sight
        limit = _LONG_SECONDS.get(sight.entry, self._frame_seconds)
        if self._waited <= limit:
            return None
        self._process.send_signal(signal.SIGABRT)  # it writes its stack trace, unless it is stopped
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_ABORT_SECONDS)
        return self._dead(f"no answer within {limit:g} s", stalled=True, stack=self._read_stack())

    def end(self) -> None:
        """Kill it and all processes that it has started."""
        self._offspring.end()
        self.channel.close()
        for file in (self._shared, self._output, self._trace):
            file.close()

    def _read_answer(self) -> _Answer:
        try:
            answer = heartbeat.read_message(self._shared.fileno(), self.look())
            self._worn, result = answer["worn"], answer.get("result")
        except (ValueError, KeyError, TypeError):
            return self._dead(_CUT_OFF)
        if "error" in answer:
            raise SequenceError(answer["error"])
        if "defect" in answer:
            raise RuntimeError(f"a defect of trackmark: {answer['defect']}")
        if isinstance(result, Outcome):
            runs = [_complete(run, self._read_output()) for run in result.runs]
            entries = [Entry(*entry) for entry in result.entries]
            return replace(result, runs=runs, entries=entries)
        return result if isinstance(result, Probed) else self._dead(str(answer["harm"]))

    def _death(self) -> Failure:
        """Return how the process ended, after its end or that of the channel."""
        try:
            code = self._process.wait(_POLL_SECONDS * 10)
        except subprocess.TimeoutExpired:
            return self._dead(_CUT_OFF)
        reason = f"its process ended with status {code}"
        if code < 0:
            reason = f"its process was killed by {_signal_name(-code)}"
        if self.look().entry == READING:
            reason += " while the frame was read"
        return self._dead(reason, stack=self._read_stack())

    def _dead(self, reason: str, **details: Any) -> Failure:
        sight, output = self.look(), self._read_output()
        rows = heartbeat.read_rows(self._shared.fileno(), sight)
        frame = sight.frame if sight.beat else -1
        return Failure(frame, reason, output, rows, entry=sight.entry, **details)

    def _read_output(self) -> str:
        return _read_end(self._output, _LONGEST_OUTPUT).decode("utf-8", "replace")

    def _read_stack(self) -> list[CodeLine]:
        """Return the stack trace if the process ended by a signal at which it writes one."""
        if -(self._process.poll() or 0) not in FATAL_SIGNALS:
            return []
        return parse_stack(_read_end(self._trace, _LONGEST_TRACE).decode("ascii", "replace"))


class _Lane:
    """Place for one worker. `steps`: of the unit that it performs; None if it is idle.

    `result`: of the last steps, or a `SequenceError`.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._owner = ""  # of the units that the worker has performed
        self.worker: Worker | None = None
        self.steps: _Steps | None = None
        self.result: Any = None

    def begin(self, steps: _Steps) -> None:
        """Give the worker the first request."""
        self.steps, self._restarted = steps, False
        self._go_on(lambda: next(steps))

    def advance(self, ready: bool) -> None:
        """Give the worker the next request if it has answered or ended.

        `ready`: whether its channel can be read. Raises `ResultsError` if a worker can't start.
        """
        steps, worker = self.steps, self.worker
        assert steps
        assert worker
        try:
            answer = worker.check(ready)
        except SequenceError as error:
            self.steps, self.result = None, error
            return
        if answer is None:
            return
        if isinstance(answer, Failure):
            self.end_worker()
            if answer.entry == STARTING:
                if self._restarted:  # the system may have killed the first one
                    raise ResultsError(
                        f"a worker process cannot start: {answer.reason}. Its output: "
                        f"{answer.output.strip()}"
                    )
                self._restarted = True
                self._give()
                return
        self._go_on(lambda: steps.send(answer))

    def end_worker(self) -> None:
        """End the worker, if there is one."""
        if self.worker:
            self.worker.end()
            self.worker = None

    def _go_on(self, step: Callable[[], Request]) -> None:
        try:
            self.request = step()
        except StopIteration as ended:
            self.steps, self.result = None, ended.value
        except SequenceError as error:
            self.steps, self.result = None, error
        else:
            self._give()

    def _give(self) -> None:
        owner, worker = self.request.unit.owner, self.worker
        if not (worker and worker.waits and owner == self._owner) or self.request.fresh:
            self.end_worker()
            self.worker, self._owner = Worker(self._limits), owner
        assert self.worker
        self.worker.give(self.request)


class Pool:
    """Worker processes that perform work units.

    A run fails only by its own doing. After a death, a hang, a garbled answer or a changed process
    state, the runs of the unit are repeated one by one in fresh processes. A run that failed next
    to others is repeated alone, too. A tracker that fails alone is the cause. If it ended its
    process, it gets units of its own from then on.
    """

    def __init__(self, limits: Limits, jobs: int = 1) -> None:
        self._limits = limits
        self._lanes = [_Lane(limits) for _ in range(jobs)]
        self._harmful_trackers: set[str] = set()

    def perform(
        self, units: Iterable[Unit], progress: Callable[[int], None] = lambda _: None
    ) -> Iterator[tuple[Unit, Outcome | SequenceError]]:
        """Yield units with their outcomes in any order; see `bench.engine.Engine`."""
        return self._work(((unit, self._apply_rule(unit)) for unit in units), progress)

    def probe(self, unit: Unit, frames: int) -> Probed | None:
        """Time a unit's trackers; None if one of them ended or hung the process.

        Raises `SequenceError` if the sequence can't be read.
        """
        ((_, result),) = self._work([(unit, self._probe(unit, frames))], lambda _: None)
        if isinstance(result, SequenceError):
            raise result
        return None if isinstance(result, Failure) else result

    def close(self) -> None:
        """End all workers."""
        for lane in self._lanes:
            lane.end_worker()

    def _work(
        self, jobs: Iterable[tuple[Unit, _Steps]], progress: Callable[[int], None]
    ) -> Iterator[tuple[Unit, Any]]:
        """Yield units with the results of their steps. Idle lanes are given work first."""
        remaining = iter(jobs)
        running: dict[_Lane, Unit] = {}
        finished: list[tuple[Unit, Any]] = []
        done = 0
        while True:
            for lane in self._lanes:
                if not lane.steps and (job := next(remaining, None)):
                    running[lane], steps = job
                    lane.begin(steps)
            yield from finished
            if not running:
                return
            channels = {lane: lane.worker.channel for lane in running if lane.worker}
            ready, _, _ = select.select(channels.values(), [], [], _POLL_SECONDS)
            for lane, channel in channels.items():
                lane.advance(channel in ready)
            finished = [(running.pop(lane), lane.result) for lane in channels if not lane.steps]
            done += sum(unit.work for unit, _ in finished)
            progress(done + sum(map(_work_done, running)))

    def _apply_rule(self, unit: Unit) -> Generator[Request, _Answer, Outcome]:
        """Perform a unit by the rule of the class."""
        suspects = [entry for entry in unit.entries if entry.tracker in self._harmful_trackers]
        others = tuple(entry for entry in unit.entries if entry not in suspects)
        outcomes: list[Outcome] = []
        runs: dict[Entry, Run] = {}
        if others:
            answer = yield Request(replace(unit, entries=others), self._limits.run_seconds)
            if isinstance(answer, Outcome):
                outcomes.append(answer)
                runs |= zip(answer.entries, answer.runs, strict=True)
                if len(others) > 1:
                    suspects += [entry for entry, run in runs.items() if run.failure]
            else:
                _check_reading(unit, answer)
                suspects = list(unit.entries)
        # Of several runs of a tracker that failed for one reason the first is repeated.
        confirmed: set[tuple[str, str]] = set()
        for entry in suspects:
            reason = _reason(runs[entry]) if entry in runs else ""
            if (entry.tracker, reason) not in confirmed:
                outcomes.append((yield from self._perform_alone(replace(unit, entries=(entry,)))))
                (runs[entry],) = outcomes[-1].runs
                if reason and reason == _reason(runs[entry]):
                    confirmed.add((entry.tracker, reason))
        if len(outcomes) == 1:
            return outcomes[0]
        return replace(
            outcomes[-1],
            runs=list(runs.values()),
            entries=list(runs),
            overhead=nan,  # it means little if parts were repeated
            seconds=sum(outcome.seconds for outcome in outcomes),
            cpu_seconds=sum(outcome.cpu_seconds for outcome in outcomes),
            peak_memory=max(outcome.peak_memory for outcome in outcomes),
        )

    def _perform_alone(self, unit: Unit) -> Generator[Request, _Answer, Outcome]:
        """Perform the only run of a unit in a fresh process; what goes wrong is its failure."""
        request = Request(unit, self._limits.run_seconds, fresh=True)
        answer = yield request
        if isinstance(answer, Failure):
            _check_reading(unit, answer)
            self._harmful_trackers.add(unit.entries[0].tracker)
            answer = yield replace(request, failure=answer)
        if isinstance(answer, Outcome):
            return answer
        assert isinstance(answer, Failure)
        raise SequenceError(
            f"{unit.source.text}: the process dies when it opens the sequence or the tracker "
            f"{unit.entries[0].tracker}: {answer.reason}."
        )

    def _probe(self, unit: Unit, frames: int) -> _Steps:
        answer = yield Request(unit, self._limits.run_seconds, probed_frames=frames)
        return answer


def _work_done(lane: _Lane) -> int:
    """Return frames times trackers of the present request."""
    frames = lane.worker.look().frames_done if lane.worker else 0
    return min(frames * len(lane.request.unit.entries), lane.request.unit.work)


def _check_reading(unit: Unit, answer: _Answer) -> None:
    """Raise `SequenceError` if a worker hung while it read a frame."""
    if isinstance(answer, Failure) and answer.stalled and answer.entry == READING:
        raise SequenceError(
            f"{unit.source.text}: frame {answer.frame} could not be read: {answer.reason}."
        )


def _reason(run: Run) -> str:
    return run.failure.partition("\n")[0]


def _complete(run: Run, output: str) -> Run:
    """Return a run of a message, whose JSON has no tuples and no numbers as keys."""
    arrays = {int(frame): named for frame, named in run.arrays.items()}
    segments = tuple(run.segments)
    return replace(run, arrays=arrays, segments=segments, output=run.output or output)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal has no name
        return f"signal {number}"


def _read_end(file: IO[bytes], size: int) -> bytes:
    """Return the last bytes of a file, at most `size`."""
    descriptor = file.fileno()
    return os.pread(descriptor, size, max(0, os.fstat(descriptor).st_size - size))


def _unnamed_file() -> IO[bytes]:
    """Return a file shared with a worker. The system deletes it.

    Raises `NoRoomError` if there is no room for it.
    """
    try:
        file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  # the caller closes it
    except OSError as error:
        raise NoRoomError(error.strerror or str(error)) from error
    return file
