"""The child's side of the board: what a pass does, and what trackers do to the process."""

import os
import time
from collections.abc import Callable, Mapping

from bench.engine.board import ELSEWHERE, NOBODY, READING, Board, Slot
from bench.engine.output import Printed

__all__ = ["BoardWatch"]

_COPY_SECONDS = 1.0
# As plain numbers: they are looked up several times a frame and tracker.
_CALLS, _FRAME, _ENTRY, _SHOWN, _COPIED, _LOST, _COMPILED = map(int, Slot)


class BoardWatch:
    """Notes on the board what a pass does, and what is done to the process; see `Watch`.

    Parameters
    ----------
    board : Board
        Shared with the supervisor.
    connected : callable
        Whether the connection to the supervisor is still there.
    output : Printed
        Sorts what is printed.
    """

    def __init__(self, board: Board, connected: Callable[[], bool], output: Printed) -> None:
        self._output = output
        self._board = board
        self._slots = board.slots
        self._connected = connected
        self._process = os.getpid()
        self._forks = 0
        os.register_at_fork(after_in_parent=self._count_fork)

    def reading(self, frame: int) -> None:
        """See `Watch`."""
        self._slots[_FRAME] = frame
        self._slots[_ENTRY] = READING
        self._slots[_CALLS] += 1

    def calling(self, entry: int, frame: int) -> None:
        """See `Watch`."""
        slots = self._slots
        slots[_FRAME] = frame
        slots[_ENTRY] = entry
        slots[_CALLS] += 1

    def called(self, entry: int) -> None:
        """See `Watch`: a copy of this process that comes back from a tracker ends here."""
        if os.getpid() != self._process:
            self._slots[_COPIED] = entry + 1
            os._exit(0)
        self._slots[_ENTRY] = NOBODY

    def shown(self, frames: int) -> None:
        """See `Watch`."""
        self._slots[_SHOWN] = frames
        self._slots[_ENTRY] = NOBODY  # also where no tracker is left to be called
        if not self._connected():
            # What is opened next would be taken for the connection, or the other way round.
            self._slots[_LOST] = 1
            os._exit(1)

    def has_called(self) -> bool:
        """See `Watch`."""
        return bool(self._slots[_CALLS])

    def misdeeds(self) -> Mapping[int, str]:
        """See `Watch`: whose call came back in two processes.

        A tracker may well fork (a pool of processes does); its copies must not come back.
        """
        self._slots[_ENTRY] = ELSEWHERE
        deadline = time.monotonic() + _COPY_SECONDS
        while self._forks and not self._slots[_COPIED] and time.monotonic() < deadline:
            time.sleep(0.01)
        self._forks = 0
        copied = self._slots[_COPIED]
        return {copied - 1: "its call came back in two processes: it forked"} if copied else {}

    def printed(self) -> Mapping[int, str]:
        """See `Watch`."""
        return self._output.take()

    def compiling(self) -> None:
        """Tell that a kernel is compiled, which may take longer than any frame."""
        self._slots[_COMPILED] += 1

    def _count_fork(self) -> None:
        self._forks += 1
