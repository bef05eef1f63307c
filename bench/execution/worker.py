"""Worker: a process that executes tasks for `pool.py`, or calls other functions of trackmark.

Requests and messages are pickles in the pipes of stdin and stdout. Unpickling them is safe because
only code of trackmark runs in a worker: trackers from outside the package have processes of their
own.
"""

import faulthandler
import os
import pickle
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Iterator
from dataclasses import replace
from queue import Empty, SimpleQueue
from time import monotonic
from typing import IO, Any

import cv2

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.recorder import NULL_OBSERVER, Observer
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.task import (
    OPENING_SECONDS,
    Limits,
    RepeatError,
    Task,
    UnusableTrackerError,
)
from trackmark.bench.experiments.tracker_spec import (
    Identity,
    TrackerSpec,
    parse_tracker,
    run_identity,
)
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.numba_compilation import prepare_numba
from trackmark.bench.operating_system import (
    MachineError,
    end_with_parent,
    limit_memory,
    machine_fault,
)
from trackmark.bench.protocols import TIMING
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import TrackerError

READING_SECONDS = 300.0
"""Longest time to read a frame, which does not count for the limit of a tracker [s]."""

_NO_MEMORY = "the memory is exhausted"
_MESSAGE_SECONDS = 0.5  # between two messages about progress
_IDLE_SECONDS = 60.0  # a Dask worker can outlive its command


class _Channel:
    """Pipe for messages to the parent, which are pairs of a kind and a value.

    `silence` is followed by the longest time until the next message [s] and the work that is done.
    `compiling` says that Numba compiles a kernel. `result` or `error` (an exception) is the answer.
    """

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe
        self.n_compiled = 0  # kernels

    def send(self, message: str, value: object = None) -> None:
        """Send a message; end this process if the parent has ended."""
        try:
            pickle.dump((message, value), self._pipe)
            self._pipe.flush()
        except OSError:
            os._exit(1)

    def on_compile(self) -> None:
        """Report a compilation, which can take longer than the time limit of a frame."""
        self.n_compiled += 1
        self.send("compiling")


_channel: _Channel | None = None  # of a worker


def main() -> None:
    """Answer the parent's requests until it has ended, or has sent none for a while.

    A request is a `functools.partial`. The command-line arguments are the parent's process
    id and a memory limit [bytes], 0 for none.
    """
    global _channel  # set once, before the first request
    parent, memory_bytes = map(int, sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command handles Ctrl-C
    pipe = os.fdopen(os.dup(0), "rb")
    _channel = _Channel(os.fdopen(os.dup(1), "wb"))
    os.dup2(2, 1)  # output of libraries does not mix with the messages
    requests: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_read, args=(pipe, requests), daemon=True).start()
    end_with_parent(parent)
    faulthandler.enable(all_threads=False)
    cv2.setNumThreads(1)
    limit_memory(memory_bytes)
    prepare_numba(_channel.on_compile)
    while True:
        try:
            request = requests.get(timeout=_IDLE_SECONDS)
        except Empty:
            os._exit(0)
        _channel.send("silence", (OPENING_SECONDS, 0))
        try:
            call = pickle.loads(request)  # noqa: S301  # written by the parent
            _channel.send("result", call())
        except Exception as error:  # noqa: BLE001  # the parent raises it
            _channel.send("error", _simplified(error))


def _read(pipe: IO[bytes], requests: "SimpleQueue[bytes]") -> None:
    """Read requests; end this process when the parent has closed the pipe or has ended."""
    try:
        while True:
            requests.put(pickle.load(pipe))  # noqa: S301  # written by the parent
    finally:
        os._exit(0)


def _simplified(error: Exception) -> Exception:
    """Return an exception that says the same without its causes, which pickles do not contain."""
    if fault := machine_fault(error):
        return fault
    if any(isinstance(cause, MemoryError) for cause in _causes(error)):
        return RepeatError(_NO_MEMORY)
    if isinstance(error, SequenceError | RepeatError | MachineError):
        return error
    return RuntimeError(f"a defect of trackmark: {traceback.format_exc()}")


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__


class _ProgressMessages(Observer):
    """Observer that sends the progress, and notices an update that took too long.

    The tracker of such an update gets a process of its own, whose time limit is exact. In this
    process, a limit for each step would need a message for each step.
    """

    def __init__(self, channel: _Channel, specs: list[TrackerSpec], limits: Limits) -> None:
        self._channel, self._specs, self._frame_seconds = channel, specs, limits.frame_seconds
        limit = max(limits.frame_seconds, *(spec.call_seconds for spec in specs))
        self._silence = READING_SECONDS + limit
        self._last_message = 0.0
        self._n_compiled = channel.n_compiled
        self.on_frame(0, 0)

    def on_tracker_return(self, run_index: int, seconds: float) -> None:
        """See `Observer`. Raises `RepeatError` after an update that took too long."""
        has_compiled = self._n_compiled != self._channel.n_compiled
        self._n_compiled = self._channel.n_compiled
        # A process of a tracker has a time limit of its own.
        has_limit = self._specs[run_index].is_isolated
        if seconds > self._frame_seconds and not has_compiled and not has_limit:
            raise RepeatError(f"an update took longer than {self._frame_seconds:g} s")

    def on_exhausted_memory(self) -> None:
        """See `Observer`: another tracker can have used the memory."""
        raise RepeatError(_NO_MEMORY)

    def on_frame(self, frame: int, n_done: int) -> None:
        """See `Observer`."""
        now = monotonic()
        if now - self._last_message > _MESSAGE_SECONDS:
            self._last_message = now
            self._channel.send("silence", (self._silence, n_done * len(self._specs)))


def run_task(task: Task, limits: Limits) -> list[Run]:
    """Return the runs of a task, in their order.

    Raises `SequenceError` if the sequence cannot be read to its end, or if the sequence or a
    tracker differs from the plan. Raises `RepeatError` if the task has to be repeated.
    """
    sequence, specs = _open(task)
    specs = [
        spec.isolated(limits.frame_seconds) if task.is_isolated or spec.is_isolated else spec
        for spec in specs
    ]
    observer = _ProgressMessages(_channel, specs, limits) if _channel else NULL_OBSERVER
    result = run_protocol(
        [(spec, run.identity.repetition) for spec, run in zip(specs, task.runs, strict=True)],
        sequence,
        task.protocol,
        keep_arrays=task.keep_arrays,
        run_seconds=limits.run_seconds,
        observer=observer,
    )
    _check_unchanged(task)  # boxes must not be stored under another version
    metadata: dict[str, Any] = {"host": socket.gethostname()}
    if task.protocol != TIMING:
        metadata["reading_seconds"] = result.reading_seconds
    return [replace(run, metadata={**run.metadata, **metadata}) for run in result.runs]


def _open(task: Task) -> tuple[Sequence, list[TrackerSpec]]:
    """Return the sequence of a task, and the trackers of its runs.

    Raises `SequenceError` if the sequence cannot be opened or has changed since the plan, and
    `UnusableTrackerError` if a tracker cannot be created as planned.
    """
    sequence = datasets.load(task.source.spec, truth=task.source.truth)
    try:
        parsed = {spec: parse_tracker(spec) for spec in dict.fromkeys(r.tracker for r in task.runs)}
    except (TrackerError, OSError) as error:
        message = str(error)
        if isinstance(error, ExternalTrackerError):
            message = message.partition("\n")[0]  # its output can differ in each worker
        raise UnusableTrackerError(
            f"{message.removesuffix('.')}. This happens in a worker process, which imports the "
            "file again."
        ) from None
    specs = [parsed[run.tracker] for run in task.runs]
    for run, spec in zip(task.runs, specs, strict=True):
        identity = run_identity(spec, sequence, run.identity.repetition, task.protocol)
        if identity.version != run.identity.version:
            raise _difference(run.tracker, run.identity, identity)
    return sequence, specs


def _check_unchanged(task: Task) -> None:
    """Raise `SequenceError` if the sequence or a tracker has changed since `_open`."""
    try:
        _open(task)
    except SequenceError:
        names = ", ".join(dict.fromkeys(run.tracker for run in task.runs))
        raise _changed(names, task.runs[0].identity) from None


def _changed(trackers: str, planned: Identity) -> SequenceError:
    return SequenceError(
        f"{trackers} on {planned.sequence}: the tracker or the sequence changed during its runs, "
        "which were not stored. Run the same command again."
    )


def _difference(tracker: str, planned: Identity, current: Identity) -> SequenceError:
    """Return the error for a run whose identity is not the planned one.

    If the source is equal, it computes other values in each process.
    """
    value: object = None
    if planned.tracker_code == current.tracker_code:
        for name, default in planned.parameters.items():
            if default != current.parameters.get(name):
                value, subject = default, f"the default of the argument {name!r}"
        if planned.tracker != current.tracker:
            value, subject = planned.tracker, "its name"
    if value is None:
        return _changed(tracker, planned)
    # Each worker finds another value: without it, equal errors are printed once.
    return UnusableTrackerError(
        f"{tracker}: {subject} differs in each process, for example {value!r}. Expected: a value "
        "that does not depend on the process, the time or a random number."
    )
