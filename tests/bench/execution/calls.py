"""Functions that workers call in tests; each ends, blocks or slows the worker in its way."""

import os
import signal
import time

from trackmark.bench.execution import worker
from trackmark.datasets import SequenceError


def die_together(task, limits):
    """Kill the worker, unless each tracker has a process of its own."""
    if not task.is_isolated:
        os.kill(os.getpid(), signal.SIGSEGV)
    return worker.run_task(task, limits)


def die(*_):
    os._exit(3)


def stay_silent(task, limits):
    """Promise a message, and never send it."""
    worker._channel.send("silence", (0.1, 0))
    time.sleep(1e6)


def exhaust_memory(*_):
    raise SequenceError("clip/1.png cannot be read") from MemoryError()


def power(number, *, exponent):
    return number**exponent


def fail(number):
    raise SequenceError(f"no sequence {number}") if number < 0 else ValueError(number)
