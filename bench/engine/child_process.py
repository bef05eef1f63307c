"""The supervisor's side of a child process: starting it, asking it, watching it, ending it."""

import os
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import IO, Any

from trackmark.bench.engine.board import ELSEWHERE, READING, Board, Sight
from trackmark.bench.engine.child import Answer
from trackmark.bench.engine.output import Tail, drain
from trackmark.bench.engine.process import machine_memory
from trackmark.bench.engine.stack_trace import FATAL_SIGNALS, CodeLine, parse_stack
from trackmark.bench.engine.unit import Limits
from trackmark.bench.numba_compilation import announce
from trackmark.bench.process_tree import Offspring
from trackmark.bench.store.files import ResultsError

_POLL_SECONDS = 0.1
_START_SECONDS = 300.0
_ABORT_SECONDS = 5.0  # time in which an aborted process writes its stack trace
_LONGEST_TRACE = 1 << 17  # bytes; `faulthandler` limits a stack to 100 lines
_LONGEST_ANSWER = 1 << 26  # bytes
_PIECE = 1 << 16
# No tracker can help how long a frame takes to read, or a sequence to open for the first time.
_LONG_SECONDS = {READING: 300.0, ELSEWHERE: 3600.0}


@dataclass(frozen=True)
class Death:
    """How a child ended, or why it was ended."""

    reason: str  # for the failure of the culprit
    sight: Sight  # what its board showed last
    output: str = ""  # what it printed last
    # Whether somebody else killed it: the user, or a machine that has no memory left.
    outside: bool = False
    stalled: bool = False  # whether it was ended for giving no sign of life
    # Stack trace at a crash or hang, innermost line first; empty if it is not known.
    stack: list[CodeLine] = field(default_factory=list)


class StartError(ResultsError):
    """A child process ended, or gave no sign of life, before it could be asked anything."""


class ChildProcess:
    """A child process, and the ways to and from it.

    `limits`: what a tracker may take. `go_on`: called now and then while the process begins; what
    it raises ends that.

    `used` tells whether it has been asked anything; `board` is shared with it; `tail` is the end of
    what it has printed.

    Raises `StartError` where it can't begin.
    """

    def __init__(self, limits: Limits, go_on: Callable[[], None]) -> None:
        self._limits = limits
        self.used = False
        ours, theirs = socket.socketpair()
        self._trace = _unnamed_file(0)
        with _unnamed_file(Board.SIZE) as shared, theirs:
            self.board = Board(shared.fileno())
            given = [theirs.fileno(), shared.fileno(), self._trace.fileno()]
            memory = limits.memory_bytes or machine_memory() // (os.cpu_count() or 1)
            self._offspring = Offspring(
                "trackmark.bench.engine.child",
                [*given, os.getpid(), memory],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=given,
            )
            self._process = self._offspring.process
            theirs.close()
            self._connection = Connection(ours.detach())
            self.tail = Tail()
            self._reader = threading.Thread(
                target=drain, args=(self._process.stdout, self.tail), daemon=True
            )
            self._reader.start()
        try:
            begun = self._hear(lambda _: go_on(), _START_SECONDS)
        except BaseException:
            self.end()
            raise
        if isinstance(begun, Death):
            self.end()
            raise StartError(
                f"a worker process can't begin: {begun.reason}. It said: {begun.output.strip()}"
            )

    def lives(self) -> bool:
        """Whether it can be asked."""
        if self._connection.closed or self._process.poll() is not None:
            return False
        return not self._connection.poll(0)  # it has said more than it was asked

    def ask(self, request: Any, look: Callable[[Sight], None]) -> "Answer | Death":
        """Send a request and wait for the answer, or for the child's end."""
        self.used = True
        self.board.clear()
        self.tail.clear()
        try:
            self._connection.send(request)
        except OSError:
            return self._death()
        return self._hear(look, self._limits.frame_seconds)

    def end(self) -> None:
        """Kill it, and what it has started, wherever that has gone."""
        self._offspring.end()
        self._reader.join(_POLL_SECONDS)
        if not self._connection.closed:
            self._connection.close()
        self._trace.close()

    def _hear(self, look: Callable[[Sight], None], limit: float) -> "Answer | Death":
        seen = self.board.look()
        heard = bytearray()
        waited = 0.0
        last = time.monotonic()
        while True:
            try:
                ready = self._connection.poll(_POLL_SECONDS)
                piece = os.read(self._connection.fileno(), _PIECE) if ready else None
            except OSError:
                return self._death()
            if piece == b"":
                return self._death()
            heard += piece or b""
            known = Answer.BEGINNING.startswith(heard[: len(Answer.BEGINNING)])
            if not known or b"\n" in (piece or b"") or len(heard) > _LONGEST_ANSWER:
                if self.board.look().compiled:  # since the last look, too
                    announce()
                return self._read(bytes(heard))
            if self._process.poll() is not None and not self._connection.poll(0):
                return self._death()
            now = time.monotonic()
            sight = self.board.look()
            # What this process itself slept through (stopped, suspended) does not count.
            waited += min(now - last, 2 * _POLL_SECONDS)
            last = now
            if sight.compiled:
                announce()
            if sight.sign_of_life != seen.sign_of_life:
                waited = 0.0
            seen = sight
            look(sight)
            bound = _LONG_SECONDS.get(sight.entry, limit)
            if waited > bound:
                # It writes its stack trace, unless it is stopped.
                self._process.send_signal(signal.SIGABRT)
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(_ABORT_SECONDS)
                said, stack = self.tail.text(), self._read_stack()
                reason = f"no answer within {bound:g} s"
                return Death(reason, sight, said, stalled=True, stack=stack)

    def _read(self, line: bytes) -> "Answer | Death":
        """An answer, unless a tracker has written into the connection, too."""
        try:
            return Answer.read(line[:_LONGEST_ANSWER])
        except (ValueError, RecursionError):
            reason = "it wrote into file descriptors that are not its own"
            return Death(reason, self.board.look(), self.tail.text())

    def _death(self) -> Death:
        """How the child ended, once it is known that it did."""
        try:
            code = self._process.wait(_POLL_SECONDS * 10)
        except subprocess.TimeoutExpired:
            code = None  # it lives, but the way to it is closed
        self._reader.join(_POLL_SECONDS * 10)
        sight = self.board.look()
        if sight.lost or code is None:
            reason = "it closed file descriptors that are not its own"
        elif code < 0:
            reason = f"its process was killed by {_signal_name(-code)}"
        else:
            reason = f"its process ended with status {code}"
        if sight.entry == READING:
            reason += " while the frame was read"
        outside = code == -signal.SIGKILL
        return Death(reason, sight, self.tail.text(), outside, stack=self._read_stack())

    def _read_stack(self) -> list[CodeLine]:
        """Return the stack trace if the process ended by a signal at which it writes one."""
        if -(self._process.poll() or 0) not in FATAL_SIGNALS:
            return []
        try:
            descriptor = self._trace.fileno()
            start = max(0, os.fstat(descriptor).st_size - _LONGEST_TRACE)
            text = os.pread(descriptor, _LONGEST_TRACE, start)
        except (OSError, ValueError):  # it is closed: another thread has called `end`
            return []
        return parse_stack(text.decode("ascii", "replace"))


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # one of the real-time signals, which have no names
        return f"signal {number}"


def _unnamed_file(size: int) -> IO[bytes]:
    """Return a file shared with a child. The system deletes it, however this process ends.

    Raises `ResultsError` where there is no room for it.
    """
    try:
        file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  # the caller closes it
        file.write(bytes(size))  # on a full disk a write fails, a mapping is fatal
    except OSError as error:
        raise ResultsError(
            f"there is no room for temporary files ({error.strerror or error}). Make some, or name "
            "another folder by the environment variable TMPDIR."
        ) from error
    return file
