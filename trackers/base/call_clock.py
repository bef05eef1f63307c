"""Clock of the calls of a tracker: wall time minus run delay.

Run delay is the time in which a thread was ready but had no processor, because other threads or
processes used it. Linux counts it in `/proc/thread-self/schedstat`. Without this file, the clock is
wall time. `bench/external/worker.py` loads this file into interpreters of users. It therefore has
the syntax of Python 3.6.
"""

import os
import sys
import threading
import time
from typing import Any, NamedTuple, Tuple

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

_SCHEDSTAT = "/proc/thread-self/schedstat"
_MAX_BYTES = 64  # of its content
_NANOSECOND = 1e-9

SHORT_CALL = 1e-4
"""Duration of a call below which its run delay is not looked up [s]."""

_UNINTERRUPTED = 5e-5  # longest time in which both clocks are read without an interruption [s]
_MAX_READINGS = 10
_VALID_TIME = 1e-3  # longest use of the counters that were read last [s]


class CallTime(NamedTuple):
    """Times of one call [s]."""

    seconds: float  # wall time minus run delay
    run_delay: float
    cpu: float  # CPU time of all threads of the process
    children: float  # CPU time of child processes that ended during the call


class CallClock:
    """Clock of consecutive calls in one thread: `start`, the call, `stop`.

    A call of less than `SHORT_CALL` counts as one without interruption by other threads, which
    would have taken longer. Its CPU time is its wall time and its run delay is 0. Only longer calls
    are worth the time of reading all counters, which is several microseconds. For the same reason,
    calls with short pauses between them share the counters that were read before the first one.
    """

    def __init__(self) -> None:
        self._thread = self._schedstat = -1
        self._counters = b""  # content of the file with the run delay
        self._ended = self._valid_until = 0.0  # end of the last call, and of the counters' use
        self._was_short = False  # the last call
        self._cpu = self._children = 0.0

    def __del__(self) -> None:
        self._close()

    @property
    def has_run_delay(self) -> bool:
        """True if the system counts run delay; otherwise the clock is wall time."""
        self._open()
        return self._schedstat >= 0

    def start(self) -> None:
        """Start a call."""
        if self._thread != threading.get_ident():
            self._open()
        if not self._was_short:
            self._cpu, self._children = time.process_time(), _read_children()
        now = time.perf_counter()
        if now - self._ended > SHORT_CALL or now > self._valid_until:
            now, self._counters = self._read_clocks()
            self._valid_until = now + _VALID_TIME
        self._started = now

    def stop(self) -> CallTime:
        """Return the times of the call that ends now."""
        self._ended = now = time.perf_counter()
        wall = now - self._started
        if wall < SHORT_CALL:
            self._was_short = True
            return CallTime(wall, 0.0, wall, 0.0)
        delay = 0.0
        if self._schedstat >= 0:
            before = self._counters
            self._ended, self._counters = self._read_clocks()
            self._valid_until = self._ended + _VALID_TIME
            wall = self._ended - self._started
            delay = min(_run_delay(self._counters) - _run_delay(before), wall)
        if self._was_short:  # the counters of `start` were not read
            self._was_short = False
            return CallTime(wall - delay, delay, wall - delay, 0.0)
        cpu = time.process_time() - self._cpu
        return CallTime(wall - delay, delay, cpu, _read_children() - self._children)

    def _read_clocks(self) -> Tuple[float, bytes]:
        """Return the time and the counters of the same moment.

        If the thread loses its processor between both, the counters contain a delay that the time
        does not, and the time of the call would be wrong by this delay. They are read again.
        """
        now, counters = time.perf_counter(), b""
        if self._schedstat < 0:
            return now, counters
        for _ in range(_MAX_READINGS):
            now = time.perf_counter()
            counters = os.pread(self._schedstat, _MAX_BYTES, 0)
            if time.perf_counter() - now < _UNINTERRUPTED:
                break
        return now, counters

    def _open(self) -> None:
        """Open the counters of the current thread; the descriptor works in this thread only."""
        self._close()
        self._thread = threading.get_ident()
        self._valid_until = 0.0  # the counters are those of another thread
        try:
            self._schedstat = os.open(_SCHEDSTAT, os.O_RDONLY | getattr(os, "O_CLOEXEC", 0))
            _run_delay(os.pread(self._schedstat, _MAX_BYTES, 0))
        except (OSError, ValueError, IndexError):  # not Linux, or a kernel without the counters
            self._close()

    def _close(self) -> None:
        if self._schedstat >= 0:
            os.close(self._schedstat)
            self._schedstat = -1


def synchronise(tracker: Any) -> None:
    """Wait until the accelerator has done the work of a tracker's call.

    If the class of the tracker has a method `synchronise`, this method waits. Otherwise PyTorch
    waits for CUDA, if the process uses it.
    """
    if getattr(type(tracker), "synchronise", None) is not None:
        tracker.synchronise()
        return
    torch = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_initialized():
        torch.cuda.synchronize()


def device_name(tracker: Any) -> str:
    """Return the accelerator of a tracker: its text `device`, or PyTorch's device; else empty."""
    device = getattr(tracker, "device", "")
    if isinstance(device, str) and device:
        return device
    torch = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_initialized():
        return str(torch.cuda.get_device_name())
    return ""


def _run_delay(counters: bytes) -> float:
    """Return the run delay in the counters of a thread [s]."""
    return int(counters.split()[1]) * _NANOSECOND


def _read_children() -> float:
    """Return the CPU time of child processes that have ended [s]; 0 if it is not known."""
    if resource is None:
        return 0.0
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
