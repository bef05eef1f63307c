"""A process in which trackers run: takes requests of its supervisor, and answers.

Nothing but `bench.engine.child_process` starts it.
"""

import ctypes
import os
import signal
import sys
import threading
import time
import traceback
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, cast

import cv2

from bench.compilation import attend
from bench.engine.board import Board, BoardWatch
from bench.engine.output import Printed
from bench.engine.performing import Failure, Outcome, Probed, perform, probe, record_failure
from bench.engine.process import can_use_files, limit_memory
from bench.engine.unit import Limits, Unit
from bench.evaluation.watch import NotAttributableError, Watch
from bench.store.files import ResultsError
from datasets import SequenceError

__all__ = ["Answer", "DefectError", "EscapedError", "Perform", "Probe", "Record", "main"]

_PARENT_SECONDS = 1.0
_IDLE_SECONDS = 60.0  # a worker of a cluster outlives the command that it worked for
_DEATH_SIGNAL = 1  # Linux: PR_SET_PDEATHSIG


class DefectError(RuntimeError):
    """An error of ours; the message holds its traceback."""


class EscapedError(Exception):
    """Something escaped from a tracker that ends a process, such as a KeyboardInterrupt."""


@dataclass(frozen=True)
class Perform:
    """Ask to perform a unit."""

    unit: Unit
    folder: Path
    limits: Limits

    def __call__(self, watch: Watch) -> Outcome:
        """Perform the unit."""
        return perform(self.unit, self.folder, self.limits, watch)


@dataclass(frozen=True)
class Record:
    """Ask to record the only run of a unit as failed."""

    unit: Unit
    folder: Path
    failure: Failure

    def __call__(self, watch: Watch) -> Outcome:
        """Record the failure."""
        return record_failure(self.unit, self.folder, self.failure)


@dataclass(frozen=True)
class Probe:
    """Ask how long a unit's trackers take for a frame."""

    unit: Unit
    frames: int

    def __call__(self, watch: Watch) -> Probed:
        """Time the trackers."""
        return probe(self.unit, self.frames, watch)


@dataclass(frozen=True)
class Answer:
    """What a child says."""

    result: Any  # what the request gave, or the exception that it raised
    # Whether trackers have left threads behind, so that the process should not be used again.
    worn: bool = False


def main() -> None:
    """Answer requests until the supervisor is gone, or has none for a while.

    The command line holds the descriptors of an inherited socket and of the board's file, the
    supervisor's process number, and a limit of memory in bytes.
    """
    descriptor, board_descriptor, parent, memory = map(int, sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the command's business
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

    watch = BoardWatch(board, connected, output)
    attend(watch.compiling)
    limit_memory(memory)
    connection.send(Answer(None))
    while connection.poll(_IDLE_SECONDS):
        try:
            request = connection.recv()
        except EOFError:
            return
        before = threading.active_count()
        result = _result(request, watch)
        watch.printed()
        connection.send(Answer(result, worn=threading.active_count() > before))


def _result(request: Any, watch: Watch) -> Any:
    try:
        return request(watch)
    except (SequenceError, ResultsError) as error:
        if can_use_files():
            return error.with_traceback(None)
        return NotAttributableError("it used up, or forbade, the files that its process needs")
    except NotAttributableError as error:
        return error.with_traceback(None)
    except MemoryError:
        return NotAttributableError("the memory is exhausted")
    except Exception as error:  # noqa: BLE001  # ours; trackers' own are caught where they are called
        if watch.has_called():  # or a tracker has changed what the harness uses
            said = "".join(traceback.format_exception_only(error)).strip()
            return NotAttributableError(f"the harness fails after it: {said}")
        return DefectError(traceback.format_exc())
    except BaseException as error:  # noqa: BLE001  # only a tracker raises such a thing here
        return EscapedError(f"it raised {type(error).__name__}")


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: nobody waits for what it would still do."""
    if sys.platform == "linux":
        # At once, and even when a tracker lets no thread run.
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
    threading.Thread(target=_watch_parent, args=(parent,), daemon=True).start()


def _watch_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PARENT_SECONDS)
    os._exit(1)
