"""Process of `worker.py`, which runs a tracker: the harness's side of its requests."""

import json
import math
import shlex
import signal
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.external import keep_process
from trackmark.bench.external.plugin import RemoteTracker
from trackmark.bench.external.process import ExternalTrackerError, LineProcess, with_output
from trackmark.bench.operating_system import (
    FRAME_FOLDER,
    FRAME_PREFIX,
    MachineError,
    TemporaryPath,
    machine_fault,
    no_room,
)
from trackmark.trackers import TrackerError
from trackmark.trackers.base.call_clock import CallTime
from trackmark.trackers.base.estimate_check import MalformedEstimateError

HOME = str(Path(__file__).parents[3])
"""Folder of the package `trackmark`."""

START, WORKER = (Path(__file__).with_name(name) for name in ("start.py", "worker.py"))
MARK = b"@@TRACKMARK:"
"""Start of each answer of `worker.py`."""


class WorkerProcess(LineProcess):
    """Process of `worker.py`, in an interpreter.

    `operations` and `arguments` are those of `worker.py`; `source` is the file of the tracker.
    `name` replaces interpreter and arguments in errors. `n_requests` is the number of requests so
    far.
    """

    stack_signal = getattr(signal, "SIGUSR1", None)

    def __init__(
        self,
        operations: str,
        arguments: Sequence[str] = (),
        *,
        python: str = sys.executable,
        source: str = "",
        name: str = "",
        environment: Mapping[str, str] | None = None,
    ) -> None:
        try:
            file = TemporaryPath(FRAME_FOLDER, FRAME_PREFIX, is_file=True)
            self._frames = file.path.open("r+b", buffering=0)
        except OSError as error:
            raise machine_fault(error) or no_room(str(error)) from error
        self.source = source
        self.n_requests = 0
        super().__init__(
            [python, "-u", str(START), str(WORKER), str(file.path), HOME, operations, *arguments],
            MARK,
            name=name or shlex.join([python, *arguments]),
            environment={
                "PYTHONFAULTHANDLER": "1",  # a crash then prints the stack of Python
                "PYTHONIOENCODING": "utf-8:backslashreplace",
                **(environment or {}),
            },
            files=[self._frames, file],
        )

    def ask(self, seconds: float, operation: str, **arguments: Any) -> dict[str, Any]:
        """Return the answer to a request; raise `ExternalTrackerError` if it fails.

        Raises `TrackerError` if the answer is that the tracker is unusable.
        """
        self.is_usable = False
        self.n_requests += 1
        request = json.dumps([self.n_requests, operation, arguments], default=int)  # of NumPy
        self.send(request.encode() + b"\n", seconds)
        reply = self._parse(self.read_line(seconds))
        if "problem" in reply:
            raise self.fail(reply["problem"])
        if "error" in reply:
            raise self.fail(f"raised {reply['error']}")
        if "unusable" in reply:
            self.close()
            raise TrackerError(reply["unusable"])
        self.is_usable = not {"invalid", "raised"} & reply.keys()
        return reply

    def call(
        self,
        tracker: RemoteTracker,
        seconds: float,
        operation: str,
        arrays: Sequence[NDArray[Any]] = (),
        **arguments: Any,
    ) -> dict[str, Any]:
        """Return the answer of the tracker to an image and a mask, and note its times.

        Raises `MalformedEstimateError` for an invalid estimate. Raises `ExternalTrackerError` if
        the tracker or its process fails.
        """
        if arrays:
            arguments["pixels"] = self._write_arrays(arrays)
        reply = self.ask(seconds, operation, **arguments)
        tracker.drawn = reply.get("drawn", tracker.drawn)
        if "invalid" in reply:
            raise MalformedEstimateError(reply["invalid"])
        if "raised" in reply:
            output = self.end_output()
            if reply["fault"]:
                raise MachineError(reply["fault"])
            raise ExternalTrackerError(with_output(f"{reply['raised']}\n{reply['trace']}", output))
        if "time" in reply:
            tracker.call_time, tracker.device = CallTime(*reply["time"]), reply["device"]
        return reply

    def drop_tracker(self, seconds: float, *key: object) -> None:
        """Drop the tracker within a time limit [s], and keep the process for the next of its key.

        If this fails, the process is not usable any more, but neither its run nor a later one is
        affected.
        """
        if self.is_usable:
            with suppress(TrackerError):
                self.ask(seconds, "drop")
        keep_process(self, *key)

    def _write_arrays(self, arrays: Iterable[NDArray[Any]]) -> list[tuple[tuple[int, ...], str]]:
        """Write arrays to the file of frames; return their shapes and types."""
        self._frames.seek(0)
        types = []
        for array in arrays:
            # Writing reports a full disk as an error; through a memory map, it would be a signal.
            if self._frames.write(np.ascontiguousarray(array).data) != array.nbytes:
                raise ExternalTrackerError("the frame cannot be written: no space left in memory.")
            types.append((array.shape, array.dtype.str))
        return types

    def read_arrays(self, types: Iterable[Sequence[Any]]) -> list[NDArray[Any]]:
        """Return the arrays that the process has written to the file of frames."""
        self._frames.seek(0)
        arrays = []
        for shape, dtype in types:
            data = self._frames.read(math.prod(shape) * np.dtype(dtype).itemsize)
            arrays.append(np.frombuffer(data, dtype).reshape(shape))
        return arrays

    def _parse(self, line: bytes) -> dict[str, Any]:
        """Return the answer to the last request; only code of a tracker can write another line."""
        try:
            request_number, reply = json.loads(line[len(MARK) :])
            is_expected = isinstance(reply, dict) and request_number == self.n_requests
        except (ValueError, TypeError):
            is_expected = False
        if not is_expected:
            received = line.decode(errors="replace")[:80]
            raise self.fail(
                f"sent {received!r}, which is not the answer to request {self.n_requests}. Write "
                "to stdout or stderr only, not to other descriptors of the process"
            )
        return dict(reply)
