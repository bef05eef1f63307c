"""File that a worker shares with its parent: heartbeat, rows of a run, and one message at a time.

The file has no name. It starts with the numbers of `Slot`; rows and a message follow. The worker
maps slots and rows into memory, so that they outlive it. The parent only reads the file: no damage
to it can crash the parent. Messages of the parent are pickles; those of a worker are JSON and
arrays, since unpickling data from a worker could execute code.
"""

import errno
import hashlib
import json
import mmap
import os
import struct
from collections.abc import Sequence
from dataclasses import fields
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.format import descr_to_dtype, dtype_to_descr
from numpy.typing import NDArray

from trackmark.bench.evaluation.loop import Observer
from trackmark.bench.store.files import ResultsError

HEAD = mmap.ALLOCATIONGRANULARITY
"""Bytes of the slots; rows, or the parent's message, follow."""

STARTING, ELSEWHERE, READING, NOBODY = -4, -3, -2, -1
"""Values of `Slot.ENTRY` if no tracker is called: before the first message, outside of the loop,
while a frame is read, and between calls."""


NO_ROOM = -errno.ENOSPC
"""Value of `Slot.LENGTH` if the disk is full."""


class NoRoomError(ResultsError):
    """A lack of room for the file."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"there is no room for temporary files ({reason}). Make some, or name another folder "
            "by the environment variable TMPDIR."
        )


class Slot(IntEnum):
    """Places of numbers of 64 bits in the file."""

    BEAT = 0
    """Changes with every call of a tracker and with every frame that is read."""
    FRAME = 1
    """Frame that is read or shown."""
    ENTRY = 2
    """Entry of the unit whose tracker is called, or one of the values above."""
    SHOWN = 3
    """Number of frames that all trackers have seen."""
    COMPILED = 4
    """Number of kernels that Numba has begun to compile."""
    ROWS = 5
    """Bytes of the rows."""
    LENGTH = 6
    """Bytes of the message, or `NO_ROOM`."""


class Sight(NamedTuple):
    """Values of the slots at a moment, by `Slot`."""

    beat: int
    frame: int
    entry: int
    shown: int
    compiled: int
    rows: int
    length: int

    @property
    def sign_of_life(self) -> tuple[int, ...]:
        """Numbers that change as long as the worker goes on."""
        return self.beat, self.entry, self.compiled


_SLOTS = struct.Struct(f"={len(Slot)}q")
# As plain numbers: the enumeration is too slow for several accesses per frame and tracker.
_BEAT, _FRAME, _ENTRY, _SHOWN, _COMPILED, _ROWS, _LENGTH = map(int, Slot)


def reset(descriptor: int, entry: int, message: bytes) -> None:
    """Write a message of the parent; everything else in the file is lost."""
    os.ftruncate(descriptor, 0)
    slots = Sight(0, 0, entry, 0, 0, 0, len(message))
    _write(descriptor, 0, [_SLOTS.pack(*slots).ljust(HEAD, b"\0"), message])


def look(descriptor: int) -> Sight:
    """Return the present values of the slots; zeros if the file is too short."""
    content = os.pread(descriptor, _SLOTS.size, 0)
    return Sight(*_SLOTS.unpack(content.ljust(_SLOTS.size, b"\0")))


def read_rows(descriptor: int, sight: Sight) -> bytes:
    """Return the rows that the worker has shared."""
    size = os.fstat(descriptor).st_size
    return os.pread(descriptor, min(max(sight.rows, 0), size), HEAD)


class Heartbeat(Observer):
    """The worker's side of the file, and the observer of its loop."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._slots = memoryview(mmap.mmap(descriptor, HEAD))[: _SLOTS.size].cast("q")
        self._process = os.getpid()
        self._rows = 0  # bytes

    def read_message(self) -> bytes:
        """Return the message of the parent."""
        self._slots[_ENTRY] = ELSEWHERE
        self._rows = 0
        return os.pread(self._descriptor, self._slots[_LENGTH], HEAD)

    def write_message(self, message: Any) -> None:
        """Write a message to the parent; see `pack`."""
        parts = pack(message)
        _write(self._descriptor, HEAD + self._rows, parts)
        self._slots[_ROWS] = self._rows  # a tracker may have overwritten it
        self._slots[_LENGTH] = sum(map(len, parts))

    def write_no_room(self) -> None:
        """Write that the disk is full."""
        self._slots[_LENGTH] = NO_ROOM

    @property
    def has_called(self) -> bool:
        """True if a frame was read, or a tracker was called, since the parent's message."""
        return self._slots[_BEAT] != 0

    def rows(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """See `Observer`: the rows lie in the file."""
        blank = super().rows(shape)
        _write(self._descriptor, HEAD, [blank.tobytes()])  # in full: a mapping needs the room
        self._slots[_ROWS] = self._rows = blank.nbytes
        shared = mmap.mmap(self._descriptor, blank.nbytes, offset=HEAD)
        return np.frombuffer(shared).reshape(shape)

    def reading(self, frame: int) -> None:
        """See `Observer`."""
        self._slots[_FRAME] = frame
        self._slots[_ENTRY] = READING
        self._slots[_BEAT] += 1

    def calling(self, entry: int, frame: int) -> None:
        """See `Observer`."""
        slots = self._slots
        slots[_FRAME] = frame
        slots[_ENTRY] = entry
        slots[_BEAT] += 1

    def called(self) -> None:
        """See `Observer`: a copy of this process that returns from a tracker ends here."""
        if os.getpid() != self._process:
            os._exit(0)
        self._slots[_ENTRY] = NOBODY

    def shown(self, frames: int) -> None:
        """See `Observer`."""
        self._slots[_SHOWN] = frames
        self._slots[_ENTRY] = NOBODY  # also if no tracker is left to be called

    def ended(self) -> None:
        """See `Observer`."""
        self._slots[_ENTRY] = ELSEWHERE

    def compiling(self) -> None:
        """Note that a kernel is compiled, which may take longer than a frame."""
        self._slots[_COMPILED] += 1


def pack(message: Any) -> list[bytes]:
    """Return JSON and arrays of a message, after their digest; dataclasses become their fields.

    Raises `ValueError` for arrays of Python objects.
    """
    arrays: list[bytes] = []
    offset = 0

    def refer(part: Any) -> Any:
        nonlocal offset
        if isinstance(part, np.generic):
            return part.item()
        if not isinstance(part, np.ndarray):
            return {field.name: getattr(part, field.name) for field in fields(part)}
        if part.dtype.hasobject:
            raise ValueError("an array of Python objects can't be stored")
        arrays.append(part.tobytes())
        offset += len(arrays[-1])
        return {_ARRAY: [dtype_to_descr(part.dtype), part.shape, offset - len(arrays[-1])]}

    text = json.dumps(message, default=refer).encode()
    parts = [len(text).to_bytes(_NUMBER, "little"), text, *arrays]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return [digest.digest(), *parts]


def read_message(descriptor: int, sight: Sight) -> Any:
    """Return the message of a worker.

    Raises `ValueError` if it is damaged. Raises `NoRoomError` if there was no room for it.
    """
    if sight.length == NO_ROOM:
        raise NoRoomError(os.strerror(errno.ENOSPC))
    size = os.fstat(descriptor).st_size
    if not (0 <= sight.rows <= size and 0 < sight.length <= size):
        raise ValueError("there is no message")
    content = memoryview(os.pread(descriptor, sight.length, HEAD + sight.rows))
    digest, number, rest = content[:_DIGEST], content[_DIGEST:_START], content[_START:]
    if hashlib.sha256(content[_DIGEST:]).digest() != digest:
        raise ValueError("the message is damaged")
    length = int.from_bytes(number, "little")

    def restore(part: dict[str, Any]) -> Any:
        if part.keys() != {_ARRAY} or not isinstance(part[_ARRAY], list):
            return part
        described, shape, offset = part[_ARRAY]
        dtype, count = descr_to_dtype(described), int(np.prod(shape, dtype=np.int64))
        stop = offset + count * dtype.itemsize
        return np.frombuffer(rest[length + offset : length + stop], dtype).reshape(shape)

    return json.loads(bytes(rest[:length]), object_hook=restore)


_ARRAY = "array of the message"
_DIGEST, _NUMBER = 32, 8  # bytes
_START = _DIGEST + _NUMBER


def _write(descriptor: int, offset: int, parts: Sequence[bytes]) -> None:
    try:
        for part in parts:
            rest = memoryview(part)
            while rest:
                written = os.pwrite(descriptor, rest, offset)
                rest, offset = rest[written:], offset + written
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise NoRoomError(os.strerror(error.errno)) from error
        raise
