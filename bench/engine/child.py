"""A process in which trackers run: takes requests of its supervisor, and answers.

Nothing but `bench.engine.child_process` starts it.
"""

import ctypes
import faulthandler
import json
import os
import resource
import signal
import sys
import threading
import time
import traceback
from dataclasses import asdict, dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, ClassVar, cast

import cv2
from pydantic import TypeAdapter

from trackmark.bench.engine.board import Board, BoardObserver
from trackmark.bench.engine.output import Printed
from trackmark.bench.engine.performing import (
    Failure,
    Outcome,
    Probed,
    perform,
    probe,
    record_failure,
)
from trackmark.bench.engine.process import can_use_files, limit_memory
from trackmark.bench.engine.unit import Limits, Unit
from trackmark.bench.evaluation.observer import NotAttributableError, Observer
from trackmark.bench.evaluation.recorder import LONGEST_TRACEBACK
from trackmark.bench.numba_compilation import attend
from trackmark.bench.store.files import ResultsError
from trackmark.datasets import SequenceError

_PARENT_SECONDS = 1.0
_IDLE_SECONDS = 60.0  # a worker of a cluster outlives the command that it worked for
_DEATH_SIGNAL = 1  # Linux: PR_SET_PDEATHSIG
_SUBREAPER = 36  # Linux: PR_SET_CHILD_SUBREAPER
_NO_MEMORY = "the memory is exhausted"
_NO_FILES = "it used up, or forbade, the files that its process needs"


class DefectError(RuntimeError):
    """An error of ours; the message holds its traceback."""


@dataclass(frozen=True)
class Perform:
    """Ask to perform a unit."""

    unit: Unit
    folder: Path
    limits: Limits

    def __call__(self, observer: Observer) -> Outcome:
        """Perform the unit."""
        return perform(self.unit, self.folder, self.limits, observer)


@dataclass(frozen=True)
class Record:
    """Ask to record the only run of a unit as failed."""

    unit: Unit
    folder: Path
    failure: Failure

    def __call__(self, observer: Observer) -> Outcome:
        """Record the failure."""
        return record_failure(self.unit, self.folder, self.failure)


@dataclass(frozen=True)
class Probe:
    """Ask how long a unit's trackers take for a frame."""

    unit: Unit
    frames: int

    def __call__(self, observer: Observer) -> Probed:
        """Time the trackers."""
        return probe(self.unit, self.frames, observer)


@dataclass(frozen=True)
class Answer:
    """What a child says: a line of JSON, since whoever reads a pickle does what it says."""

    BEGINNING: ClassVar[bytes] = b'{"result": '

    result: Outcome | Probed | None = None  # what the request gave
    # What it raised instead: one of the supervisor's errors; `harm` where one of several trackers
    # did harm, `escaped` where the one that was called raised what ends a process.
    raised: str = ""
    said: str = ""  # the exception's text
    # Whether trackers have left threads behind, so that the process should not be used again.
    worn: bool = False

    def send(self, descriptor: int) -> None:
        """Write it."""
        with open(descriptor, "wb", closefd=False) as way:  # it has no path
            way.write(json.dumps(asdict(self)).encode() + b"\n")

    @staticmethod
    def read(line: bytes) -> "Answer":
        """What was sent. Raises `ValueError`, `RecursionError` for anything else."""
        return _ANSWERS.validate_python(json.loads(line))


_ANSWERS = TypeAdapter(Answer)


def main() -> None:
    """Answer requests until the supervisor is gone, or has none for a while.

    The command line holds the descriptors of an inherited socket, of the board's file and of the
    stack trace's file, the supervisor's process number, and a limit of memory in bytes.
    """
    descriptor, board_descriptor, trace_descriptor, parent, memory = map(int, sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the command's business
    faulthandler.enable(trace_descriptor, all_threads=False)
    # The supervisor aborts a hung worker: do not write its memory to disk.
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    _end_with(parent)
    cv2.setNumThreads(1)
    board = Board(board_descriptor)
    os.close(board_descriptor)
    output = Printed(lambda: board.look().entry, sys.stdout)
    # Two streams of one kind: what a tracker prints is kept in the order of printing.
    sys.stdout = sys.stderr = cast("Any", output)
    connection = Connection(descriptor)
    socket = os.fstat(connection.fileno())

    def connected() -> bool:
        try:
            now = os.fstat(descriptor)
        except OSError:
            return False
        return (now.st_dev, now.st_ino) == (socket.st_dev, socket.st_ino)

    observer = BoardObserver(board, connected, output)
    attend(observer.compiling)
    limit_memory(memory)
    Answer().send(descriptor)
    fresh = True
    while connection.poll(_IDLE_SECONDS):
        try:
            request = connection.recv()
        except EOFError:
            return
        before = threading.active_count()
        answer = _answer(request, observer, fresh)
        fresh = False
        observer.printed()
        replace(answer, worn=threading.active_count() > before).send(descriptor)


def _answer(request: Any, observer: Observer, fresh: bool = True) -> Answer:
    """What comes of a request; `fresh`: it is the first of this process."""
    try:
        return Answer(request(observer))
    except (SequenceError, ResultsError) as error:
        # Where a tracker was called, it may have taken the memory that decoding lacks.
        if isinstance(error.__cause__, MemoryError) and (observer.has_called() or not fresh):
            return Answer(raised="harm", said=_NO_MEMORY)
        if can_use_files():
            kind = "ResultsError" if isinstance(error, ResultsError) else "SequenceError"
            return Answer(raised=kind, said=str(error))
        return Answer(raised="harm", said=_NO_FILES)
    except NotAttributableError as error:
        return Answer(raised="harm", said=str(error))
    except MemoryError:
        return Answer(raised="harm", said=_NO_MEMORY)
    except Exception as error:  # noqa: BLE001  # ours; trackers' own are caught where they are called
        if observer.has_called():  # or a tracker has changed what the harness uses
            said = "".join(traceback.format_exception_only(error)).strip()[:LONGEST_TRACEBACK]
            return Answer(raised="harm", said=f"the harness fails after it: {said}")
        return Answer(raised="DefectError", said=traceback.format_exc())
    except BaseException as error:  # noqa: BLE001  # only a tracker raises such a thing here
        return Answer(raised="escaped", said=f"it raised {type(error).__name__}")


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: nobody waits for what it would still do."""
    if sys.platform == "linux":
        # At once, and even when a tracker lets no thread run.
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
        # What a tracker starts and abandons stays this process's own, and is ended with it.
        ctypes.CDLL(None).prctl(_SUBREAPER, 1)
    threading.Thread(target=_watch_parent, args=(parent,), daemon=True).start()


def _watch_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PARENT_SECONDS)
    os._exit(1)
