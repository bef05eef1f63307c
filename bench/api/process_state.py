"""State that all trackers of a process share."""

import gc
import os
import random
import signal
import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np


@dataclass(frozen=True)
class ProcessState:
    """State of a process, through which one tracker can affect another.

    States are equal if the first five fields are: imports change the other fields.
    """

    generator_states: tuple[Any, ...]  # state of the global random generators
    arithmetic: Mapping[str, Any]  # handling of floating-point errors
    folder: str
    environment: Mapping[str, str]
    umask: int
    threads: int = field(compare=False)  # number of OpenCV's threads
    handlers: Mapping[int, Any] = field(compare=False)  # of signals
    recursion_limit: int = field(compare=False)
    collects: bool = field(compare=False)  # whether Python's garbage collector is enabled
    streams: tuple[Any, Any] = field(compare=False)  # `sys.stdout` and `sys.stderr`
    warning_filters: Sequence[Any] = field(compare=False)

    @classmethod
    def current(cls) -> "ProcessState":
        """Return the current state."""
        # Only the legacy interface has a state for the whole process.
        name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002
        generator_states = (random.getstate(), name, np.asarray(keys).tobytes(), *rest)
        folder = os.getcwd()  # noqa: PTH109  # compared, not used
        umask = os.umask(0o077)  # the mask can only be read by setting it
        os.umask(umask)
        return cls(
            generator_states,
            np.geterr(),
            folder,
            dict(os.environ),
            umask,
            threads=cv2.getNumThreads(),
            handlers={
                signal_number: signal.getsignal(signal_number)
                for signal_number in signal.valid_signals()
            },
            recursion_limit=sys.getrecursionlimit(),
            collects=gc.isenabled(),
            streams=(sys.stdout, sys.stderr),
            warning_filters=list(warnings.filters),
        )

    def restore(self) -> None:
        """Set the process to this state."""
        python_state, name, keys, *rest = self.generator_states
        random.setstate(python_state)
        np.random.set_state((name, np.frombuffer(keys, np.uint32), *rest))  # noqa: NPY002  # as above
        np.seterr(**self.arithmetic)
        os.chdir(self.folder)
        if os.environ != self.environment:
            os.environ.clear()
            os.environ.update(self.environment)
        os.umask(self.umask)
        cv2.setNumThreads(self.threads)
        sys.setrecursionlimit(self.recursion_limit)
        (gc.enable if self.collects else gc.disable)()
        sys.stdout, sys.stderr = self.streams
        if warnings.filters != self.warning_filters:
            warnings.resetwarnings()  # also drops the cache of filtered warnings
            warnings.filters[:] = self.warning_filters  # type: ignore[index]  # a list
        self._restore_signals()

    def _restore_signals(self) -> None:
        """Restore the handlers that Python has set; only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            return
        for signal_number, handler in self.handlers.items():
            if handler is not None and signal.getsignal(signal_number) is not handler:
                if signal_number == signal.SIGALRM:
                    signal.setitimer(signal.ITIMER_REAL, 0)  # its default handler ends the process
                signal.signal(signal_number, handler)
