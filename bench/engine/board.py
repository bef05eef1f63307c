"""What a child process shows its supervisor, in memory that both see.

The supervisor learns from it which tracker is called on which frame even when the child can't
say anything any more.
"""

import mmap
from enum import IntEnum
from typing import NamedTuple

__all__ = ["ELSEWHERE", "NOBODY", "READING", "Board", "Sight", "Slot"]

NOBODY = -1
"""No tracker is being called, in the midst of a pass."""

READING = -2
"""A frame is fetched."""

ELSEWHERE = -3
"""No pass is going on: a sequence is opened, or results are written, however long it takes."""


class Slot(IntEnum):
    """Places on the board, one number each."""

    CALLS = 0
    FRAME = 1
    ENTRY = 2
    SHOWN = 3
    COPIED = 4
    LOST = 5
    COMPILED = 6


class Sight(NamedTuple):
    """What the board shows at a moment.

    Attributes
    ----------
    calls : int
        Changes with every call of a tracker and with every frame that is fetched.
    frame : int
        Frame that is fetched or shown.
    entry : int
        Which of the unit's entries is called; `READING`, `NOBODY` or `ELSEWHERE`
        where none is.
    shown : int
        Frames that all trackers have seen.
    lost : bool
        Whether the child found its connection to the supervisor closed.
    compiled : int
        Kernels that were not on disk, and that it has begun to compile.
    """

    calls: int
    frame: int
    entry: int
    shown: int
    lost: bool
    compiled: int

    @property
    def sign_of_life(self) -> tuple[int, ...]:
        """Changes as long as the child goes on."""
        return self.calls, self.entry, self.compiled


class Board:
    """Memory that a supervisor and its child share.

    Parameters
    ----------
    descriptor : int
        Of a file of `SIZE` bytes that both have opened; it may be closed then.
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
        calls, frame, entry, shown, _, lost, compiled = self.slots.tolist()
        return Sight(calls, frame, entry, shown, bool(lost), compiled)
