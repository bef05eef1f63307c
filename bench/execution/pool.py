"""Pool of workers: processes that execute tasks, and the repetition of tasks that end a worker.

The backend `local` has one pool, and each thread of a Dask worker has one. A thread for each worker
reads its messages, so that the pool needs no feature of a particular operating system.
"""

import os
import pickle
import signal
import subprocess
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any, TypeAlias, TypeVar

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.task import OPENING_SECONDS, Limits, RepeatError, Task
from trackmark.bench.numba_compilation import log_compilation
from trackmark.bench.operating_system import (
    FRAME_FOLDER,
    FRAME_PREFIX,
    MachineError,
    ProcessTree,
    machine_memory,
    remove_abandoned,
    temporary_file,
)
from trackmark.bench.store.database import ResultsError
from trackmark.datasets import SequenceError

T = TypeVar("T")
R = TypeVar("R")

_POLL_SECONDS = 0.1
_EXIT_SECONDS = 1.0  # between the end of a worker's messages and the end of its process
_MAX_OUTPUT = 2_000  # bytes of a worker's output that an error repeats

_Messages: TypeAlias = "SimpleQueue[tuple[Worker, str, Any]]"
"""Messages of all workers: the worker, kind and value. The kind `end` is the end of its pipe."""


class Worker:
    """Process that answers one request at a time, and puts its messages into a queue.

    `work` is the work that it has reported for the current request, and `has_begun` whether it has
    reported anything. `environment` is added to the environment of this process.
    """

    def __init__(
        self,
        messages: _Messages,
        memory_bytes: int,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._output = temporary_file()
        self._tree = ProcessTree.run_module(
            "trackmark.bench.execution.worker",
            [os.getpid(), memory_bytes],
            environment=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._output,
        )
        self.process = self._tree.process
        self._thread = threading.Thread(target=self._read, args=(messages,), daemon=True)
        self._thread.start()

    def _read(self, messages: _Messages) -> None:
        assert self.process.stdout is not None
        # The last message of a worker that is killed can be incomplete.
        with self.process.stdout as pipe, suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                messages.put((self, *pickle.load(pipe)))  # noqa: S301  # written by trackmark
        messages.put((self, "end", None))

    def send(self, call: "partial[Any]") -> None:
        """Send a request; if the worker has ended, the message `end` follows."""
        self.has_begun = False
        self.on_progress(OPENING_SECONDS, 0)
        self._last = monotonic()
        self._output.seek(0)  # also the position at which the worker writes
        self._output.truncate()
        assert self.process.stdin is not None
        with suppress(OSError):
            pickle.dump(pickle.dumps(call), self.process.stdin)
            self.process.stdin.flush()

    def on_progress(self, silence: float, work: int) -> None:
        """Note the work that is done; the next message is due within `silence` [s]."""
        self._waited, self._silence, self.work = 0.0, silence, work

    def is_overdue(self) -> bool:
        """Return whether no message has come in time; called at intervals of `_POLL_SECONDS`."""
        now = monotonic()
        # The time in which this process itself was stopped does not count.
        self._waited += min(now - self._last, 2 * _POLL_SECONDS)
        self._last = now
        return self._waited > self._silence

    def exit_reason(self) -> str:
        """Return how the process has ended, with the last line of its output."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_EXIT_SECONDS)
        status = self.process.poll()
        reason = f"ended with status {status}"
        if status is not None and status < 0:
            reason = f"was killed by {_signal_name(-status)}"
        self._output.seek(max(0, self._output.seek(0, os.SEEK_END) - _MAX_OUTPUT))
        output = self._output.read().decode("utf-8", "replace").strip()
        return f"the worker process {reason}" + (f". Its output: {output}" if output else "")

    def end(self) -> None:
        """Kill the process and all processes that it has started."""
        self._tree.end()
        remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)  # of the killed process
        self._thread.join(_EXIT_SECONDS)
        with suppress(OSError):  # a request that was not read
            if self.process.stdin is not None:
                self.process.stdin.close()
        self._output.close()


class Pool:
    """Worker processes that execute tasks, or other calls of trackmark's functions.

    Trackers of the package share a worker, in which an error of one could affect the others. If a
    worker ends, hangs or lacks memory, its task is therefore repeated with a process for each
    tracker. Only the tracker that fails then is stored as failed.
    """

    def __init__(
        self,
        n_workers: int,
        limits: Limits | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)
        self._n_workers, self._limits, self._memory_bytes = n_workers, limits or Limits(), 0
        self._environment = environment
        if limits is not None:
            share = machine_memory() // (os.cpu_count() or 1)
            self._memory_bytes = limits.memory_bytes or share
        self._messages: _Messages = SimpleQueue()
        self._idle: list[Worker] = []
        self._busy: dict[Worker, partial[Any]] = {}
        self._ended: list[tuple[partial[Any], Any]] = []  # calls with their results
        self._n_failed_starts = 0

    def run_tasks(
        self, tasks: Iterable[Task], progress: Callable[[int], None] = lambda _: None
    ) -> Iterator[tuple[Task, list[Run] | SequenceError]]:
        """Yield tasks with their runs as they end, in any order.

        `tasks` is consumed while the work proceeds. `progress` is called repeatedly with the work
        (`Task.work`) that is done. An exception instead of runs is an error of the sequence;
        errors of trackers are stored in their runs.
        """
        remaining, repeated = iter(tasks), deque[Task]()
        work = 0

        def next_call() -> "partial[list[Run]] | None":
            task = repeated.popleft() if repeated else next(remaining, None)
            return None if task is None else partial(run_in_worker, task, self._limits)

        def report(current: int) -> None:
            progress(work + current)

        for call, result in self.run(next_call, report):
            task, _ = call.args
            if isinstance(result, RepeatError):
                if not task.is_isolated:
                    repeated.append(replace(task, is_isolated=True))
                    continue
                result = SequenceError(
                    f"{task.source.spec}: {result}. This has happened twice, the second time with "
                    "each tracker in a process of its own. If another attempt ends in the same "
                    "way, either the sequence cannot be read, or a tracker ends other processes: "
                    "run the trackers one at a time."
                )
            work += task.work
            progress(work)
            yield task, result

    def run(
        self,
        next_call: Callable[[], "partial[Any] | None"],
        progress: Callable[[int], None] = lambda _: None,
    ) -> Iterator[tuple["partial[Any]", Any]]:
        """Yield calls with their results as they end, in any order.

        `next_call` returns None if there is no call at present. `progress` gets the work that the
        current calls have done. The result is a `SequenceError` if the call has raised it, and a
        `RepeatError` if the worker has ended. All other exceptions are raised.
        """
        while True:
            while len(self._busy) < self._n_workers and (call := next_call()) is not None:
                self._begin(call)
            if not self._busy and not self._ended:
                return
            ended, self._ended = self._ended, []
            yield from ended  # meanwhile, the workers that have answered have the next calls
            progress(sum(worker.work for worker in self._busy))
            if self._busy:
                self._wait()

    def close(self) -> None:
        """End all workers."""
        for worker in [*self._idle, *self._busy]:
            worker.end()
        self._idle.clear()
        self._busy.clear()

    def _begin(self, call: "partial[Any]") -> None:
        worker = self._idle.pop() if self._idle else None
        if worker is not None and worker.process.poll() is not None:  # idle for too long
            worker.end()
            worker = None
        worker = worker or Worker(self._messages, self._memory_bytes, self._environment)
        self._busy[worker] = call
        worker.send(call)

    def _wait(self) -> None:
        """Handle the next message, and end workers that have not sent theirs in time."""
        with suppress(Empty):
            worker, message, value = self._messages.get(timeout=_POLL_SECONDS)
            if worker in self._busy:
                self._handle_message(worker, message, value)
        for worker in [worker for worker in self._busy if worker.is_overdue()]:
            worker.end()
            late = RepeatError("the worker process did not answer in time")
            self._ended.append((self._busy.pop(worker), late))

    def _handle_message(self, worker: Worker, message: str, value: Any) -> None:
        if message == "end":
            self._replace(worker)
            return
        worker.has_begun, self._n_failed_starts = True, 0
        if message == "silence":
            worker.on_progress(*value)
        elif message == "compiling":
            log_compilation()
            worker.on_progress(OPENING_SECONDS, worker.work)
        else:
            call = self._busy.pop(worker)
            if isinstance(value, RepeatError):  # its memory may be exhausted
                worker.end()
            else:
                self._idle.append(worker)
            if message == "error" and not isinstance(value, SequenceError | RepeatError):
                raise value
            self._ended.append((call, value))

    def _replace(self, worker: Worker) -> None:
        """Replace a worker that has ended, or end its call if that had begun."""
        call, reason = self._busy.pop(worker), worker.exit_reason()
        worker.end()
        if worker.has_begun:
            self._ended.append((call, RepeatError(reason)))
            return
        self._n_failed_starts += 1
        if self._n_failed_starts > 1:  # the operating system may have killed the first worker
            raise ResultsError(f"{reason}. A worker cannot start.")
        self._begin(call)


def run_in_worker(task: Task, limits: Limits) -> list[Run]:
    """Return the runs of a task, in a worker; see `bench.execution.worker.run_task`."""
    # Imported here, because only workers need the loop over frames.
    from trackmark.bench.execution import worker

    return worker.run_task(task, limits)


def map_in_workers(
    function: Callable[[T], R],
    items: Iterable[T],
    n_workers: int,
    environment: Mapping[str, str] | None = None,
) -> Iterator[R]:
    """Yield the results of a function, in the order of the items, which workers compute.

    `environment` is added to the environment of the workers, which libraries read when they load.
    Raises `SequenceError` if the function raises one, `MachineError` if a worker ends, and
    `RuntimeError` for all other exceptions of the function.
    """
    calls = [partial(function, item) for item in items]
    result_by_call: dict[int, Any] = {}
    with closing(Pool(n_workers, environment=environment)) as pool:
        remaining = iter(calls)
        answers = pool.run(lambda: next(remaining, None))
        for call in calls:
            while id(call) not in result_by_call:
                answered, result = next(answers)
                result_by_call[id(answered)] = result
            result = result_by_call.pop(id(call))
            if isinstance(result, RepeatError):
                raise MachineError(f"{result}. Start the same command again.")
            if isinstance(result, SequenceError):
                raise result
            yield result


def _signal_name(signal_number: int) -> str:
    try:
        return signal.Signals(signal_number).name
    except ValueError:  # real-time signals have no name
        return f"signal {signal_number}"
