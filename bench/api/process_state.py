"""State that all trackers of a process share."""

import gc
import os
import random
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np


@contextmanager
def restored_process_state() -> Iterator[None]:
    """After the context, restore the state through which a tracker can affect other trackers."""
    python_generator = random.getstate()
    numpy_generator = np.random.get_state()  # noqa: NPY002  # only it has a state of the process
    arithmetic = np.geterr()  # handling of floating-point errors
    folder, environment = os.getcwd(), dict(os.environ)  # noqa: PTH109  # restored as it is
    umask = os.umask(0o077)  # the mask can only be read by setting it
    os.umask(umask)
    n_threads, recursion_limit = cv2.getNumThreads(), sys.getrecursionlimit()
    handlers = {number: signal.getsignal(number) for number in signal.valid_signals()}
    collect = gc.enable if gc.isenabled() else gc.disable
    streams, warning_filters = (sys.stdout, sys.stderr), list(warnings.filters)
    try:
        yield
    finally:
        random.setstate(python_generator)
        np.random.set_state(numpy_generator)  # noqa: NPY002  # as above
        np.seterr(**arithmetic)
        os.chdir(folder)
        if os.environ != environment:
            os.environ.clear()
            os.environ.update(environment)
        os.umask(umask)
        cv2.setNumThreads(n_threads)
        sys.setrecursionlimit(recursion_limit)
        collect()
        sys.stdout, sys.stderr = streams
        if warnings.filters != warning_filters:
            warnings.resetwarnings()  # also drops the cache of filtered warnings
            warnings.filters[:] = warning_filters  # type: ignore[index]  # a list
        _restore_signals(handlers)


def _restore_signals(handlers: Mapping[signal.Signals, Any]) -> None:
    """Restore the handlers that Python has set; only the main thread can."""
    if threading.current_thread() is not threading.main_thread():
        return
    for signal_number, handler in handlers.items():
        if handler is not None and signal.getsignal(signal_number) is not handler:
            if signal_number == signal.SIGALRM:
                signal.setitimer(signal.ITIMER_REAL, 0)  # its default handler ends the process
            signal.signal(signal_number, handler)
