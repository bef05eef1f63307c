"""What a child process shows its supervisor, in memory that both see.

The supervisor learns from it which tracker is called on which frame even when the child can't
say anything any more.
"""

import mmap
import os
import time
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from trackmark.bench.engine.output import Printed
from trackmark.bench.engine.process import umask
from trackmark.bench.evaluation.observer import Observer

NOBODY = -1
"""No tracker is being called, in the midst of a pass."""

READING = -2
"""A frame is fetched."""

ELSEWHERE = -3
"""No pass is going on: a sequence is opened, or results are written, however long it takes."""

_COPY_SECONDS = 1.0  # in which a copy of the process that comes back from a call is noticed


class Slot(IntEnum):
    """Places on the board, one number each."""

    CALLS = 0
    """Changes with every call of a tracker and with every frame that is fetched."""
    FRAME = 1
    """Frame that is fetched or shown."""
    ENTRY = 2
    """Which of the unit's entries is called; `READING`, `NOBODY` or `ELSEWHERE` where none is."""
    SHOWN = 3
    """Frames that all trackers have seen."""
    COPIED = 4
    """Entry whose call came back in a copy of the process, counted from 1."""
    LOST = 5
    """Whether the child found its connection to the supervisor closed."""
    COMPILED = 6
    """Kernels that were not on disk, and that it has begun to compile."""


class Sight(NamedTuple):
    """What the board shows at a moment, by `Slot`."""

    calls: int
    frame: int
    entry: int
    shown: int
    copied: int
    lost: int
    compiled: int

    @property
    def sign_of_life(self) -> tuple[int, ...]:
        """Changes as long as the child goes on."""
        return self.calls, self.entry, self.compiled


class Board:
    """Memory that a supervisor and its child share.

    `descriptor`: of a file of `SIZE` bytes that both have opened; it may be closed then.
    """

    SIZE = 8 * len(Slot)

    def __init__(self, descriptor: int) -> None:
        self.slots = memoryview(mmap.mmap(descriptor, self.SIZE)).cast("q")

    def clear(self) -> None:
        """Forget the last unit."""
        for slot in Slot:
            self.slots[slot] = 0
        self.slots[Slot.ENTRY] = ELSEWHERE

    def look(self) -> Sight:
        """What it shows now."""
        return Sight(*self.slots.tolist())


# As plain numbers: they are looked up several times a frame and tracker.
_CALLS, _FRAME, _ENTRY, _SHOWN, _COPIED, _LOST, _COMPILED = map(int, Slot)


class BoardObserver(Observer):
    """The child's side: notes what a pass does, and what trackers do to the process."""

    def __init__(self, board: Board, connected: Callable[[], bool], output: Printed) -> None:
        self._output = output
        self._slots = board.slots
        self._connected = connected
        self._process = os.getpid()
        self._mask = umask()
        self._forks = 0
        os.register_at_fork(after_in_parent=self._count_fork)

    def reading(self, frame: int) -> None:
        """See `Observer`."""
        self._slots[_FRAME] = frame
        self._slots[_ENTRY] = READING
        self._slots[_CALLS] += 1

    def calling(self, entry: int, frame: int) -> None:
        """See `Observer`."""
        slots = self._slots
        slots[_FRAME] = frame
        slots[_ENTRY] = entry
        slots[_CALLS] += 1

    def called(self, entry: int) -> None:
        """See `Observer`: a copy of this process that comes back from a tracker ends here."""
        if os.getpid() != self._process:
            self._slots[_COPIED] = entry + 1
            os._exit(0)
        os.umask(self._mask)  # files are written between calls
        self._slots[_ENTRY] = NOBODY

    def shown(self, frames: int) -> None:
        """See `Observer`."""
        self._slots[_SHOWN] = frames
        self._slots[_ENTRY] = NOBODY  # also where no tracker is left to be called
        if not self._connected():
            # What is opened next would be taken for the connection, or the other way round.
            self._slots[_LOST] = 1
            os._exit(1)

    def has_called(self) -> bool:
        """See `Observer`."""
        return bool(self._slots[_CALLS])

    def misdeeds(self) -> Mapping[int, str]:
        """See `Observer`: whose call came back in two processes.

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
        """See `Observer`."""
        return self._output.take()

    def compiling(self) -> None:
        """Tell that a kernel is compiled, which may take longer than any frame."""
        self._slots[_COMPILED] += 1

    def _count_fork(self) -> None:
        self._forks += 1
