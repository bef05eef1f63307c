"""Clock of the calls of a tracker: wall time minus run delay.

Run delay is the time in which a thread was ready but had no processor, because other threads or
processes used it. Linux counts it in `/proc/thread-self/schedstat`. Without this file, the clock is
wall time. `bench/external/worker.py` loads this file into interpreters of users. It therefore has
the syntax of Python 3.6.
"""

import os
import resource
import sys
import threading
import time
from typing import Any, NamedTuple

_RUSAGE_THREAD = getattr(resource, "RUSAGE_THREAD", None)
_NANOSECOND = 1e-9

MAX_RUN_DELAY = 0.1
"""Run delay as a fraction of the wall time above which other load has disturbed a measurement."""


class CallTime(NamedTuple):
    """Times of one call [s]."""

    seconds: float  # wall time minus run delay
    run_delay: float
    cpu: float  # CPU time of all threads of the process
    children: float  # CPU time of child processes that ended during the call


def run_delay_share(seconds: float, run_delay: float) -> float:
    """Return the run delay as a fraction of the wall time, which is the sum of both times."""
    wall = seconds + run_delay
    return run_delay / wall if wall else 0.0


def read_run_delay(schedstat: int) -> float:
    """Return the run delay of a thread so far [s]; `schedstat` is the descriptor of its file."""
    return int(os.pread(schedstat, 64, 0).split()[1]) * _NANOSECOND


class CallClock:
    """Clock of consecutive calls in one thread: `start`, the call, `stop`.

    A call without a context switch ran without interruption. Its CPU time is its wall time, and
    its run delay is 0. This needs 1 µs less than reading all counters after each call.
    """

    def __init__(self) -> None:
        self._thread = self._schedstat = self._switches = -1
        self._delay = self._children = 0.0

    @property
    def has_run_delay(self) -> bool:
        """True if the system counts run delay; otherwise the clock is wall time."""
        self._open()
        return self._schedstat >= 0

    def __del__(self) -> None:
        self._close()

    def start(self) -> None:
        """Start a call."""
        if self._thread != threading.get_ident():
            self._open()
        if self._schedstat >= 0:
            switches = _count_switches()
            if switches != self._switches:
                self._switches = switches
                self._delay = read_run_delay(self._schedstat)
                self._children = _read_children()
        else:
            self._children = _read_children()
        self._cpu = time.process_time()
        self._started = time.perf_counter()

    def stop(self) -> CallTime:
        """Return the times of the call that ends now."""
        wall = time.perf_counter() - self._started
        delay = 0.0
        if self._schedstat >= 0:
            if _count_switches() == self._switches:
                return CallTime(wall, 0.0, wall, 0.0)
            # A switch between the counters of `start` can exceed the call.
            delay = min(read_run_delay(self._schedstat) - self._delay, wall)
        cpu = time.process_time() - self._cpu
        return CallTime(wall - delay, delay, cpu, _read_children() - self._children)

    def _open(self) -> None:
        """Open the counters of the current thread; the descriptor works in this thread only."""
        self._close()
        self._thread, self._switches = threading.get_ident(), -1
        if _RUSAGE_THREAD is None:
            return
        try:
            self._schedstat = os.open("/proc/thread-self/schedstat", os.O_RDONLY | os.O_CLOEXEC)
            read_run_delay(self._schedstat)
        except (OSError, ValueError, IndexError):  # not Linux, or a kernel without the counters
            self._close()

    def _close(self) -> None:
        if self._schedstat >= 0:
            os.close(self._schedstat)
            self._schedstat = -1


class SelfTimed:
    """Base class of trackers that measure the time of their calls without conversion or transfer.

    `call_time` has the times of the last call of `init` or `update`.
    """

    call_time: CallTime

    @property
    def device(self) -> str:
        """Name of the accelerator; empty if unknown."""
        return ""


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


def _count_switches() -> int:
    """Return the number of context switches of this thread so far."""
    usage = resource.getrusage(_RUSAGE_THREAD)  # type: ignore[arg-type]  # not None with schedstat
    return usage.ru_nvcsw + usage.ru_nivcsw


def _read_children() -> float:
    """Return the CPU time of child processes that have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
