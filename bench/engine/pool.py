"""Pool of worker processes: starts, watches and ends workers, and attributes failures to trackers.

The local engine has one pool, and each thread of a Dask worker has one. A pool uses a single
thread: it waits for bytes from its workers, and reads their heartbeats in between.
"""

import fcntl
import os
import pickle
import select
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, TypeAlias

from trackmark.bench.engine import heartbeat
from trackmark.bench.engine.heartbeat import READING, STARTING, HeartbeatState
from trackmark.bench.engine.process_state import machine_memory
from trackmark.bench.engine.stack_trace import FATAL_SIGNALS, CodeLine, parse_stack
from trackmark.bench.engine.work_unit import (
    Entry,
    Failure,
    Limits,
    Request,
    Unit,
    UnusableTrackerError,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.external.process import FRAME_FOLDER, FRAME_PREFIX
from trackmark.bench.machine_errors import MachineError, temporary_file
from trackmark.bench.numba_compilation import log_compilation
from trackmark.bench.process_tree import ProcessTree
from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError
from trackmark.reports.temporary_paths import remove_abandoned

_POLL_SECONDS = 0.1
_SPARE_SECONDS = 30.0  # after the time limit of a tracker in a process of its own
_ABORT_SECONDS = 5.0  # time in which an aborted process writes its stack trace
_LONGEST_TRACE = 1 << 17  # bytes; `faulthandler` limits a stack to 100 lines
_LONGEST_OUTPUT = 1 << 14  # bytes of a worker's output that are kept
_MAX_OUTPUT = 1 << 20  # maximum size of the output file [bytes]
_CHANNEL_CLOSED = "its process closed or overwrote file descriptors of the harness"
# Time limits of steps that do not depend on the tracker: reading a frame, starting, and opening.
_LONG_SECONDS = {READING: 300.0, STARTING: 300.0, heartbeat.ELSEWHERE: 3600.0}


_Answer: TypeAlias = list[Run] | Failure
_Steps: TypeAlias = Generator[Request, _Answer, dict[Entry, Run]]


class Worker:
    """The parent's handle for a worker process."""

    def __init__(self, limits: Limits) -> None:
        self._frame_seconds = self._frame_limit = limits.frame_seconds
        self._used = False
        self._has_stray_threads = False  # whether trackers have left threads running in the process
        self._shared, self._output, self._trace = (temporary_file() for _ in range(3))
        fcntl.fcntl(self._output, fcntl.F_SETFL, os.O_APPEND)  # also after truncation
        self.channel, theirs = socket.socketpair()
        memory = limits.memory_bytes or machine_memory() // (os.cpu_count() or 1)
        descriptors = [theirs.fileno(), self._shared.fileno(), self._trace.fileno()]
        self._process_tree = ProcessTree.run_module(
            "trackmark.bench.engine.worker",
            [*descriptors, os.getpid(), memory],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            pass_fds=descriptors,
        )
        self._process = self._process_tree.process
        theirs.close()

    @property
    def is_idle(self) -> bool:
        """True if the worker can get a request: it runs and its channel has no unread data."""
        silent = not select.select([self.channel], [], [], 0)[0]
        return self._process.poll() is None and silent and not self._has_stray_threads

    def send(self, request: Request) -> None:
        """Send a request; raise `MachineError` if the disk is full."""
        entry = heartbeat.ELSEWHERE if self._used else STARTING
        self._used = True
        if request.unit.call_seconds:  # its own time limits come first, and give a better message
            self._frame_limit = max(self._frame_seconds, request.unit.call_seconds + _SPARE_SECONDS)
        heartbeat.reset(self._shared.fileno(), entry, pickle.dumps(request))
        self._output.truncate(0)
        self._last_state, self._waited, self._last = self.read_state(), 0.0, time.monotonic()
        with suppress(OSError):  # `check` notices that the worker has ended
            self.channel.send(b".")

    def read_state(self) -> HeartbeatState:
        """Return the current numbers of the heartbeat."""
        return heartbeat.read_state(self._shared.fileno())

    def check(self, ready: bool) -> "_Answer | None":
        """Return the worker's answer, or its failure; None while it works.

        `ready` is whether the channel can be read. Raises `SequenceError` if the worker reports
        one, and `RuntimeError` for a defect of trackmark.
        """
        if self.read_state().compiled:
            log_compilation()
        if ready:
            with suppress(OSError):
                if byte := self.channel.recv(1):
                    return self._read_answer() if byte == b"." else self._failure(_CHANNEL_CLOSED)
            return self._failure_after_end()
        if self._process.poll() is not None:
            return (
                None if select.select([self.channel], [], [], 0)[0] else self._failure_after_end()
            )
        if os.fstat(self._output.fileno()).st_size > _MAX_OUTPUT:
            text = self._read_output()
            self._output.truncate(0)
            self._output.write(text.encode())
        state, now = self.read_state(), time.monotonic()
        # The time in which this process itself was stopped does not count.
        self._waited += min(now - self._last, 2 * _POLL_SECONDS)
        self._last = now
        if state.sign_of_life != self._last_state.sign_of_life:
            self._waited = 0.0
        self._last_state = state
        limit = _LONG_SECONDS.get(state.entry, self._frame_limit)
        if self._waited <= limit:
            return None
        self._process.send_signal(signal.SIGABRT)  # makes the worker write its stack trace
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_ABORT_SECONDS)
        return self._failure(
            f"no answer within {limit:g} s", stalled=True, stack=self._read_stack()
        )

    def end(self) -> None:
        """Kill the worker and all processes that it has started."""
        self._process_tree.end()
        remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)  # of the killed process
        self.channel.close()
        for file in (self._shared, self._output, self._trace):
            file.close()

    def _read_answer(self) -> _Answer:
        try:
            answer = heartbeat.read_message(self._shared.fileno(), self.read_state())
            self._has_stray_threads = answer["worn"]
        except (ValueError, KeyError, TypeError):
            return self._failure(_CHANNEL_CLOSED)
        if "machine" in answer:
            raise MachineError(answer["machine"])
        if "unusable" in answer:
            raise UnusableTrackerError(answer["unusable"])
        if "error" in answer:
            raise SequenceError(answer["error"])
        if "defect" in answer:
            raise RuntimeError(f"a defect of trackmark: {answer['defect']}")
        if "harm" in answer:
            return self._failure(answer["harm"])
        return [_restore_types(run, self._read_output()) for run in answer["result"]]

    def _failure_after_end(self) -> Failure:
        """Return the failure of a worker whose process or channel has ended."""
        try:
            code = self._process.wait(_POLL_SECONDS * 10)
        except subprocess.TimeoutExpired:
            return self._failure(_CHANNEL_CLOSED)
        reason = f"its process ended with status {code}"
        if code < 0:
            reason = f"its process was killed by {_signal_name(-code)}"
        if self.read_state().entry == READING:
            reason += " while the frame was read"
        return self._failure(reason, stack=self._read_stack())

    def _failure(self, reason: str, **details: Any) -> Failure:
        state, output = self.read_state(), self._read_output()
        rows = heartbeat.read_rows(self._shared.fileno(), state)
        frame = state.frame if state.beat else -1
        return Failure(frame, reason, output, rows, entry=state.entry, **details)

    def _read_output(self) -> str:
        return _read_end(self._output, _LONGEST_OUTPUT).decode("utf-8", "replace")

    def _read_stack(self) -> list[CodeLine]:
        """Return the stack trace; empty if the process did not end by a signal that writes one."""
        if -(self._process.poll() or 0) not in FATAL_SIGNALS:
            return []
        return parse_stack(_read_end(self._trace, _LONGEST_TRACE).decode("ascii", "replace"))


class _Slot:
    """Slot of the pool, with at most one worker, which is replaced after a failure.

    `steps` is the generator of requests for the current unit, or None if the worker is idle.
    `result` is what the last generator returned, or a `SequenceError`.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._owner = ""  # owner of the units that the worker has run
        self.worker: Worker | None = None
        self.steps: _Steps | None = None
        self.result: dict[Entry, Run] | SequenceError

    def begin(self, steps: _Steps) -> None:
        """Send the first request of a unit to the worker."""
        self.steps, self._restarted = steps, False
        self._request_next(lambda: next(steps))

    def advance(self, ready: bool) -> None:
        """Send the next request to the worker if it has answered or ended.

        `ready` is whether the worker's channel can be read. Raises `ResultsError` if a worker
        cannot start.
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
                if self._restarted:  # the operating system may have killed the first worker
                    raise ResultsError(
                        f"a worker process cannot start: {answer.reason}. Its output: "
                        f"{answer.output.strip()}"
                    )
                self._restarted = True
                self._send()
                return
        self._request_next(lambda: steps.send(answer))

    def end_worker(self) -> None:
        """End the worker, if there is one."""
        if self.worker:
            self.worker.end()
            self.worker = None

    def _request_next(self, step: Callable[[], Request]) -> None:
        try:
            self.request = step()
        except StopIteration as ended:
            self.steps, self.result = None, ended.value
        except SequenceError as error:
            self.steps, self.result = None, error
        else:
            self._send()

    def _send(self) -> None:
        owner, worker = self.request.unit.owner, self.worker
        if not (worker and worker.is_idle and owner == self._owner) or self.request.fresh:
            self.end_worker()
            self.worker, self._owner = Worker(self._limits), owner
        assert self.worker
        self.worker.send(self.request)


class Pool:
    """Worker processes that perform work units.

    A run must not fail because of other trackers of its unit. After a crash, a hang, a damaged
    answer or a changed process state, the runs of the unit are therefore repeated one by one in
    fresh processes. A run that failed in a unit with others is also repeated alone. A run that
    fails alone is stored as failed. If its process crashed or hung, its tracker runs alone from
    then on.
    """

    def __init__(self, limits: Limits, jobs: int = 1) -> None:
        remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)
        self._limits = limits
        self._slots = [_Slot(limits) for _ in range(jobs)]
        self._harmful_trackers: set[str] = set()

    def perform(
        self, units: Iterable[Unit], progress: Callable[[int], None] = lambda _: None
    ) -> Iterator[tuple[Unit, dict[Entry, Run] | SequenceError]]:
        """Yield units with their runs in any order; see `bench.engine.Engine`."""
        remaining = iter(units)
        running: dict[_Slot, Unit] = {}
        finished: list[tuple[Unit, dict[Entry, Run] | SequenceError]] = []
        done = 0
        while True:
            for slot in self._slots:
                if not slot.steps and (unit := next(remaining, None)):
                    running[slot] = unit
                    slot.begin(self._apply_rule(unit))
            yield from finished  # after idle workers have got units, which run meanwhile
            if not running:
                return
            channels = {slot: slot.worker.channel for slot in running if slot.worker}
            ready, _, _ = select.select(channels.values(), [], [], _POLL_SECONDS)
            for slot, channel in channels.items():
                slot.advance(channel in ready)
            finished = [(running.pop(slot), slot.result) for slot in channels if not slot.steps]
            done += sum(unit.work for unit, _ in finished)
            progress(done + sum(map(_work_done, running)))

    def close(self) -> None:
        """End all workers."""
        for slot in self._slots:
            slot.end_worker()

    def _apply_rule(self, unit: Unit) -> _Steps:
        """Run a unit by the rule in the docstring of the class."""
        suspects = [entry for entry in unit.entries if entry.tracker in self._harmful_trackers]
        others = tuple(entry for entry in unit.entries if entry not in suspects)
        runs: dict[Entry, Run] = {}
        if others:
            answer = yield Request(replace(unit, entries=others), self._limits.run_seconds)
            if isinstance(answer, Failure):
                _check_reading(unit, answer)
                suspects = list(unit.entries)
            else:
                runs |= zip(others, answer, strict=True)
                if len(others) > 1:
                    suspects += [entry for entry, run in runs.items() if run.failure]
        # If several runs of a tracker failed for the same reason, only the first is repeated.
        confirmed: set[tuple[str, str]] = set()
        for entry in suspects:
            reason = _reason(runs[entry]) if entry in runs else ""
            if (entry.tracker, reason) not in confirmed:
                runs[entry] = yield from self._perform_alone(replace(unit, entries=(entry,)))
                if reason and reason == _reason(runs[entry]):
                    confirmed.add((entry.tracker, reason))
        return runs

    def _perform_alone(self, unit: Unit) -> Generator[Request, _Answer, Run]:
        """Run the only entry of a unit in a fresh process; store a crash or hang as its failure."""
        request = Request(unit, self._limits.run_seconds, fresh=True)
        answer = yield request
        if isinstance(answer, Failure):
            _check_reading(unit, answer)
            self._harmful_trackers.add(unit.entries[0].tracker)
            answer = yield replace(request, failure=answer)
        if isinstance(answer, Failure):
            raise SequenceError(
                f"{unit.source.text}: the worker process fails while it opens the sequence or the "
                f"tracker {unit.entries[0].tracker}: {answer.reason}."
            )
        (run,) = answer
        return run


def _work_done(slot: _Slot) -> int:
    """Return the work that the current request has done: frames times trackers."""
    frames = slot.worker.read_state().frames_done if slot.worker else 0
    return min(frames * len(slot.request.unit.entries), slot.request.unit.work)


def _check_reading(unit: Unit, failure: Failure) -> None:
    """Raise `SequenceError` if a worker hung while it read a frame."""
    if failure.stalled and failure.entry == READING:
        raise SequenceError(
            f"{unit.source.text}: frame {failure.frame} could not be read: {failure.reason}."
        )


def _reason(run: Run) -> str:
    return run.failure.partition("\n")[0]


def _restore_types(run: Run, output: str) -> Run:
    """Restore types of a received run that JSON cannot represent; add the output and the host."""
    return replace(
        run,
        arrays={int(frame): named for frame, named in run.arrays.items()},
        segments=tuple(run.segments),
        output=run.output or output,
        circumstances={**run.circumstances, "host": socket.gethostname()},
    )


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # real-time signals have no name
        return f"signal {number}"


def _read_end(file: IO[bytes], size: int) -> bytes:
    """Return the last bytes of a file, at most `size`."""
    descriptor = file.fileno()
    return os.pread(descriptor, size, max(0, os.fstat(descriptor).st_size - size))
