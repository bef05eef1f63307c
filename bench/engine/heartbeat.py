"""File that a worker shares with its parent: heartbeat, rows of a run, and a message.

The file has no name. It starts with the numbers of `HeartbeatState`; rows and a message follow. The
worker maps numbers and rows into memory, so that they remain after its death. The parent does not
map the file: damage to the file cannot crash the parent. The parent's messages are pickles. A
worker's messages are JSON and arrays, because unpickling data from a worker could execute code.
"""

import errno
import hashlib
import json
import mmap
import os
import struct
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.format import descr_to_dtype, dtype_to_descr
from numpy.typing import NDArray

from trackmark.bench.evaluation.loop import Observer
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.machine_errors import no_room
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times

HEAD = mmap.ALLOCATIONGRANULARITY
"""Size of the numbers at the start of the file [bytes]; rows or the parent's message follow."""

STARTING, ELSEWHERE, READING, NOBODY = -4, -3, -2, -1
"""Values of `HeartbeatState.entry` if no tracker is being called: before the first message,
outside of the loop, while a frame is read, and between calls."""


NO_ROOM = -errno.ENOSPC
"""Value of `HeartbeatState.length` if the disk is full."""


class HeartbeatState(NamedTuple):
    """Numbers of 64 bits at the start of the file."""

    beat: int  # number of calls of trackers and of frames read
    frame: int  # frame that is read or passed to the tracker
    entry: int  # index in the unit of the tracker that is called, or one of the values above
    frames_done: int  # number of frames that all trackers have seen
    compiled: int  # number of kernels that Numba has begun to compile
    rows: int  # bytes of the rows
    length: int  # bytes of the message, or `NO_ROOM`

    @property
    def sign_of_life(self) -> tuple[int, ...]:
        """Numbers of which at least one changes while the worker makes progress."""
        return self.beat, self.entry, self.compiled


_BEAT, _FRAME, _ENTRY, _SHOWN, _COMPILED, _ROWS, _LENGTH = range(len(HeartbeatState._fields))
_SLOTS = struct.Struct(f"={len(HeartbeatState._fields)}q")


def reset(descriptor: int, entry: int, message: bytes) -> None:
    """Clear the file and write a message of the parent."""
    os.ftruncate(descriptor, HEAD)  # the worker has mapped the head
    slots = HeartbeatState(0, 0, entry, 0, 0, 0, len(message))
    _write(descriptor, 0, [_SLOTS.pack(*slots).ljust(HEAD, b"\0"), message])


def read_state(descriptor: int) -> HeartbeatState:
    """Return the current numbers; zeros if the file is too short."""
    content = os.pread(descriptor, _SLOTS.size, 0)
    return HeartbeatState(*_SLOTS.unpack(content.ljust(_SLOTS.size, b"\0")))


def read_rows(descriptor: int, state: HeartbeatState) -> bytes:
    """Return the bytes of the rows that the worker has shared."""
    size = os.fstat(descriptor).st_size
    return os.pread(descriptor, min(max(state.rows, 0), size), HEAD)


class Heartbeat(Observer):
    """Observer that writes the progress of the worker's loop to the shared file."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._slots = memoryview(mmap.mmap(descriptor, HEAD))[: _SLOTS.size].cast("q")
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
        self._slots[_ROWS] = self._rows  # a tracker may have overwritten the number
        self._slots[_LENGTH] = sum(map(len, parts))

    def write_no_room(self) -> None:
        """Write that the disk is full."""
        self._slots[_LENGTH] = NO_ROOM

    @property
    def has_called(self) -> bool:
        """True if a frame was read or a tracker was called since the parent's last message."""
        return self._slots[_BEAT] != 0

    def rows(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """See `Observer`; the rows are mapped from the shared file."""
        blank = super().rows(shape)
        _write(self._descriptor, HEAD, [blank.tobytes()])  # allocates the space on disk
        self._slots[_ROWS] = self._rows = blank.nbytes
        shared = mmap.mmap(self._descriptor, blank.nbytes, offset=HEAD)
        return np.frombuffer(shared).reshape(shape)

    def on_frame_read(self, frame: int) -> None:
        """See `Observer`."""
        self._slots[_FRAME] = frame
        self._slots[_ENTRY] = READING
        self._slots[_BEAT] += 1

    def on_tracker_call(self, entry: int, frame: int) -> None:
        """See `Observer`."""
        slots = self._slots
        slots[_FRAME] = frame
        slots[_ENTRY] = entry
        slots[_BEAT] += 1

    def on_tracker_return(self) -> None:
        """See `Observer`."""
        self._slots[_ENTRY] = NOBODY

    def on_frames_done(self, frames: int) -> None:
        """See `Observer`."""
        self._slots[_SHOWN] = frames
        self._slots[_ENTRY] = NOBODY  # also if all trackers have failed

    def on_loop_end(self) -> None:
        """See `Observer`."""
        self._slots[_ENTRY] = ELSEWHERE

    def compiling(self) -> None:
        """Count a compilation of a kernel, which can take longer than the time limit of a frame."""
        self._slots[_COMPILED] += 1


def pack(message: Any) -> list[bytes]:
    """Encode a message: return its digest, the length of its JSON, the JSON, and its arrays.

    Raises `ValueError` for arrays of Python objects.
    """
    arrays: list[bytes] = []
    offset = 0

    def refer(part: Any) -> Any:
        nonlocal offset
        if isinstance(part, np.generic):
            return part.item()
        if not isinstance(part, np.ndarray):
            values = {field.name: getattr(part, field.name) for field in fields(part)}
            return {_CLASS: type(part).__name__, **values}
        if part.dtype.hasobject:
            raise ValueError("an array of Python objects cannot be stored")
        arrays.append(part.tobytes())
        offset += part.nbytes
        return {_ARRAY: [dtype_to_descr(part.dtype), part.shape, offset - part.nbytes]}

    text = json.dumps(message, default=refer).encode()
    parts = [len(text).to_bytes(_START - _DIGEST, "little"), text, *arrays]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return [digest.digest(), *parts]


def read_message(descriptor: int, state: HeartbeatState) -> Any:
    """Return the message of a worker; raise `ValueError` if it is damaged.

    Raises `MachineError` if the worker's disk was full.
    """
    if state.length == NO_ROOM:
        raise no_room(os.strerror(errno.ENOSPC))
    size = os.fstat(descriptor).st_size
    if not (0 <= state.rows <= size and 0 < state.length <= size):
        raise ValueError("the file contains no message")
    content = memoryview(os.pread(descriptor, state.length, HEAD + state.rows))
    if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
        raise ValueError("the message is damaged")
    length = int.from_bytes(content[_DIGEST:_START], "little")
    text, arrays = content[_START : _START + length], content[_START + length :]

    def restore(part: dict[str, Any]) -> Any:
        if _ARRAY in part:
            described, shape, offset = part[_ARRAY]
            dtype = descr_to_dtype(described)
            stop = offset + int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
            return np.frombuffer(arrays[offset:stop], dtype).reshape(shape)
        return _CLASSES[part.pop(_CLASS)](**part) if _CLASS in part else part

    return json.loads(bytes(text), object_hook=restore)


_CLASSES: dict[str, Any] = {kind.__name__: kind for kind in (Identity, Run, Segmentation, Times)}
_ARRAY, _CLASS = "trackmark.array", "trackmark.class"  # keys in JSON
_DIGEST, _START = 32, 40  # bytes of the digest, and before the JSON


def _write(descriptor: int, offset: int, parts: Sequence[bytes]) -> None:
    try:
        for part in parts:
            rest = memoryview(part)
            while rest:
                written = os.pwrite(descriptor, rest, offset)
                rest, offset = rest[written:], offset + written
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise no_room(os.strerror(error.errno)) from error
        raise
