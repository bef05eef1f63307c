"""What trackers print: kept for the run that fails, and never on the command's own output."""

import io
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, TextIO

LONGEST = 16_384
"""Characters or bytes of a tracker's last words that are kept."""


class Tail:
    """The end of a text that may be long."""

    def __init__(self) -> None:
        self._pieces: deque[str] = deque()
        self._length = 0
        self._lock = threading.Lock()

    def clear(self) -> None:
        """Forget what was printed."""
        with self._lock:
            self._pieces.clear()
            self._length = 0

    def add(self, piece: str) -> None:
        """Append, and forget what has become too old."""
        with self._lock:
            self._pieces.append(piece[-LONGEST:])
            self._length += len(self._pieces[-1])
            while self._length - len(self._pieces[0]) >= LONGEST:
                self._length -= len(self._pieces.popleft())

    def text(self) -> str:
        """What is left, at most `LONGEST` characters."""
        with self._lock:
            return "".join(self._pieces)[-LONGEST:]


class Printed(io.TextIOBase):
    """Stands for `sys.stdout` and `sys.stderr` of a child: sorts what is printed by tracker.

    It is passed on too, so that the supervisor has it when the child dies.
    """

    def __init__(self, whose: Callable[[], int], through: TextIO) -> None:
        self._whose = whose
        self._through = through
        self._tails: dict[int, Tail] = {}

    def writable(self) -> bool:
        """Yes."""
        return True

    def write(self, text: str, /) -> int:
        """Keep and pass on."""
        text = text.encode("utf-8", "backslashreplace").decode()
        self._tails.setdefault(self._whose(), Tail()).add(text)
        self._through.write(text)
        return len(text)

    def fileno(self) -> int:
        """Descriptor of the real one: what is written there is not sorted."""
        return self._through.fileno()

    @property
    def encoding(self) -> str:  # type: ignore[override]  # the stub lets it be set
        """That of the real one."""
        return self._through.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]  # as above
        """That of the real one."""
        return self._through.errors

    @property
    def buffer(self) -> Any:
        """Bytes of the real one: what is written there is not sorted."""
        return self._through.buffer

    def flush(self) -> None:
        """Pass on what is held back."""
        self._through.flush()

    def take(self) -> dict[int, str]:
        """What was printed since the last time, by entry."""
        taken = {entry: tail.text() for entry, tail in self._tails.items()}
        self._tails.clear()
        return taken


def drain(stream: io.BufferedReader, tail: Tail) -> None:
    """Read a stream to its end, keep the end of it, and close it."""
    with stream:
        while piece := stream.read1(LONGEST):
            tail.add(piece.decode("utf-8", "replace"))
