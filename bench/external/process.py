"""Child process of an external tracker that exchanges lines with the harness.

`LineProcess(command)` starts a process whose standard streams are pipes. `send` writes bytes, and
`read_line` returns the next line of its stdout; both have a time limit. The end of the other output
(stderr, and lines of stdout without the mark of the protocol) is part of every failure. `close`
ends the process and everything that it started; the garbage collector and the end of this process
do so as well. A failed process is closed before the error is raised.
"""

import os
import select
import shlex
import signal
import subprocess
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep
from typing import IO, Any

from trackmark.bench.process_tree import ProcessTree
from trackmark.trackers import TrackerError

TAIL_CHARACTERS = 2_000
"""Number of characters of a process's output that an error repeats."""

START_SECONDS = 300.0
"""Default time limit from the start of the process until it is ready [s]."""

FRAME_SECONDS = 60.0
"""Default time limit of an initialisation or update [s]."""

_MAX_UNREAD = 1 << 26  # bytes
_MAX_TAIL = 4 * TAIL_CHARACTERS  # bytes; a character has at most 4
_STACK_SECONDS = 1.0  # until the first part of a stack is written
_EXIT_SECONDS = 5.0  # between the end of the output and the end of the process
_CHUNK = 1 << 16

SHARED_MEMORY = "/dev/shm"  # noqa: S108  # names of files in it have a random part


def frame_file_options() -> dict[str, Any]:
    """Return arguments for `tempfile`: files for frames are in memory, and name their process."""
    folder = SHARED_MEMORY if os.access(SHARED_MEMORY, os.W_OK) else None
    return {"prefix": f"{_frame_files(os.getpid())}-", "dir": folder}


def delete_frame_files(pid: int) -> None:
    """Delete the files for frames of a process that was killed."""
    for folder in {SHARED_MEMORY, tempfile.gettempdir()}:
        for file in Path(folder).glob(f"{_frame_files(pid)}-*"):
            file.unlink(missing_ok=True)


def _frame_files(pid: int) -> str:
    return f"trackmark-frames-{pid}"


class ExternalTrackerError(TrackerError):
    """Error of a tracker's process; names the command, the problem and the end of its output."""


class LineProcess:
    """Process that is controlled by lines on its stdin and stdout.

    Parameters
    ----------
    command : sequence of str
        Program and arguments; no shell is used.
    environment : mapping of str to str
        Variables in addition to those of this process.
    folder : Path, optional
        Working directory; by default that of this process.
    pass_fds : sequence of int
        Descriptors that the process inherits.
    stack_signal : signal.Signals, optional
        Signal at which the process writes its stack to stderr; sent if it exceeds a time limit.

    Raises
    ------
    ExternalTrackerError
        If the command cannot be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        pass_fds: Sequence[int] = (),
        stack_signal: signal.Signals | None = None,
    ) -> None:
        self.command, self._stack_signal = shlex.join(command), stack_signal
        try:
            self._tree = ProcessTree(
                command,
                environment,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                pass_fds=pass_fds,
            )
        except (OSError, ValueError) as error:  # ValueError: a null character
            raise ExternalTrackerError(
                f"{self.command}: the command cannot be started: {error}. Check its path."
            ) from None
        self._process = self._tree.process
        streams = self._process.stdin, self._process.stdout, self._process.stderr
        self._stdin, self._stdout, self._stderr = map(_unblocked, streams)
        self._end = weakref.finalize(self, _end, self._tree, streams)
        self._lines = bytearray()  # unread output
        self._tail = bytearray()
        self._stderr_open = True

    @property
    def closed(self) -> bool:
        """True after `close` and after every error."""
        return not self._end.alive

    def send(self, data: bytes, seconds: float) -> None:
        """Write bytes to the process.

        Raises `ExternalTrackerError` if the process has ended, or does not read all bytes within a
        number of seconds.
        """
        if self.closed:  # its descriptor can belong to another file by now
            raise ExternalTrackerError(f"{self.command}: the process has ended.")
        unsent, limit = memoryview(data), monotonic() + seconds
        while True:
            try:
                unsent = unsent[os.write(self._stdin, unsent) :]
            except BlockingIOError:
                pass
            except OSError:  # closed pipe
                raise self._ended() from None
            if not unsent:
                return
            # Output is read meanwhile: otherwise, both processes could wait for each other.
            if monotonic() > limit or not self._wait(limit, sending=True):
                raise self._late(f"did not read its input in {seconds:g} s")

    def read_line(self, seconds: float, mark: bytes = b"") -> bytes:
        """Return the next line of stdout that contains `mark`, without its line end.

        Other lines count as output for error messages.

        Raises `ExternalTrackerError` if the process ends, writes no such line within a number of
        seconds, or writes more than 64 MiB without a line end.
        """
        limit = monotonic() + seconds
        start = 0  # bytes before it have no line end
        while True:
            while (stop := self._lines.find(b"\n", start)) >= 0:
                line = bytes(self._lines[:stop])
                del self._lines[: stop + 1]
                start = 0
                if mark in line:
                    return line.removesuffix(b"\r")
                self._keep(line + b"\n")
            start = len(self._lines)
            if monotonic() > limit or not self._wait(limit):
                raise self._late(f"did not answer in {seconds:g} s")

    def fail(self, problem: str) -> ExternalTrackerError:
        """End the process; return the error, whose text is the command and `problem`."""
        self._drain()
        self.close()
        output = self._tail.decode(errors="replace")[-TAIL_CHARACTERS:].strip()
        text = f"{self.command}: the process {problem}."
        *earlier, last = output.splitlines() or [""]
        if earlier and last not in problem:  # lists of failures show the start of the error
            text += f" Its last line: {last[:200]}"
        return ExternalTrackerError(f"{text} The end of its output:\n{output}" if output else text)

    def close(self, seconds: float = 0.0) -> None:
        """End the process and all that it started, after up to `seconds` to end by itself."""
        if seconds and self._end.alive:
            assert self._process.stdin is not None
            self._process.stdin.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)
        self._end()

    def _wait(self, limit: float, *, sending: bool = False) -> bool:
        """Read output that arrives before `limit`; return False if nothing happened until then.

        If `sending`, also return if the process can read more input.
        """
        poller = select.poll()
        poller.register(self._stdout, select.POLLIN)
        if self._stderr_open:
            poller.register(self._stderr, select.POLLIN)
        if sending:
            poller.register(self._stdin, select.POLLOUT)
        while not (ready := dict(poller.poll(min(max(0.0, limit - monotonic()), 1.0) * 1000))):
            # A descendant that still runs can keep the streams of an ended process open.
            if self._process.poll() is not None:
                raise self._ended()
            if monotonic() >= limit:
                return False
        if self._stderr in ready:
            self._stderr_open = self._keep(_read(self._stderr))
        if self._stdout in ready:
            chunk = _read(self._stdout)
            if not chunk:
                raise self._ended()
            self._lines += chunk
            if len(self._lines) > _MAX_UNREAD:
                raise self.fail(f"wrote more than {_MAX_UNREAD >> 20} MiB without a line end")
        return True

    def _late(self, problem: str) -> ExternalTrackerError:
        """Return the error for a process that exceeded a time limit, with its stack."""
        if self._stack_signal is not None:
            self._drain()
            self._process.send_signal(self._stack_signal)
            select.select([self._stderr], [], [], _STACK_SECONDS)
            sleep(_STACK_SECONDS / 10)  # the stack is written in parts
        return self.fail(problem)

    def _ended(self) -> ExternalTrackerError:
        """Return the error for a process that has closed its stdin or stdout."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_EXIT_SECONDS)
        status = self._process.returncode
        if status is None:
            return self.fail("closed its stdin or stdout")
        if status < 0:
            return self.fail(f"ended by signal {-status} ({signal.strsignal(-status)})")
        return self.fail(f"ended with status {status}")

    def _drain(self) -> None:
        """Add the output that the process has already written to the tail."""
        if self._end.alive:
            self._keep(self._lines)
            for stream in (self._stdout, self._stderr):
                # A process that writes without end must not delay the error.
                for _ in range(_MAX_UNREAD // _CHUNK):
                    if not self._keep(_read(stream)):
                        break

    def _keep(self, output: bytes | bytearray) -> bool:
        """Add output to the tail; return whether there was any."""
        self._tail += output[-_MAX_TAIL:]
        del self._tail[:-_MAX_TAIL]
        return bool(output)


def _unblocked(stream: IO[bytes] | None) -> int:
    assert stream is not None
    os.set_blocking(stream.fileno(), False)
    return stream.fileno()


def _read(descriptor: int) -> bytes:
    """Return available output; empty if there is none or the stream has ended."""
    try:
        return os.read(descriptor, _CHUNK)
    except BlockingIOError:
        return b""


def _end(tree: ProcessTree, streams: Sequence[IO[bytes] | None]) -> None:
    tree.end()
    for stream in streams:
        if stream is not None:
            stream.close()
