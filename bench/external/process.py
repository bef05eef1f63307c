"""Child process of an external tracker that exchanges lines with the harness."""

import fcntl
import os
import re
import select
import shlex
import signal
import subprocess
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import clock_gettime, monotonic, sleep
from typing import IO, NamedTuple

from trackmark.bench.machine_errors import machine_fault, temporary_file
from trackmark.bench.process_tree import ProcessTree
from trackmark.reports.temporary_paths import TemporaryPath
from trackmark.trackers import TrackerError

TAIL_CHARACTERS = 2_000
"""Number of characters of a process's output that an error repeats."""

FRAME_FOLDER = "/dev/shm" if os.access("/dev/shm", os.W_OK) else tempfile.gettempdir()  # noqa: S108  # names in it are random
"""Folder of the files with frames: in memory if possible."""

FRAME_PREFIX = "trackmark-frames-"
"""Start of the names of these files, if they have names."""

_MAX_OUTPUT = 1 << 26  # bytes
_MAX_TAIL = 4 * TAIL_CHARACTERS  # bytes; a character has at most 4
_STACK_SECONDS = 1.0  # in which a stack is written
_EXIT_SECONDS = 5.0  # between the end of the output and the end of the process
_CHUNK = 1 << 16

_FRAMES = r"(?:Traceback \(most recent call last\):\n)?(?:[ \t].*\n)*"  # of a traceback
_EXIT_MESSAGE = re.compile(
    rf"^(?:Exception ignored |Error in atexit).*\n{_FRAMES}(?:[\w.]+(?:: .*)?\n)?"
    r"|^\S+:\d+: \w*Warning: .*\n(?:[ \t].*\n)?",
    re.MULTILINE,
)
"""Exception in a destructor or an exit handler, or a warning, as Python prints it."""

_EXCEPTION = re.compile(r"^Traceback \(most recent call last\):\n(?:[ \t].*\n)+(.+)", re.MULTILINE)
"""Traceback; the group is the first line of the exception."""


class ProcessCounters(NamedTuple):
    """Counters of a process since its start [s]."""

    run_delay: float  # of its main thread
    cpu: float  # of all threads


class ExternalTrackerError(TrackerError):
    """Error of a tracker's process; names the command, the problem and the end of its output."""


class LineProcess:
    """Process that is controlled by lines on its stdin and stdout.

    Other output (stderr, and lines of stdout without the mark of the protocol) goes to a file,
    whose end is part of every failure. `close`, failures, the garbage collector and the end of this
    process end the process and all that it started.

    `command` is the program with its arguments; no shell is used. `name` replaces the command in
    errors. `environment` has variables in
    addition to those of this process; `folder` is the working directory. The process inherits the
    descriptors of `files`. When it has ended, `files` and `paths` are closed.

    Raises `ExternalTrackerError` if the command cannot be started.
    """

    stack_signal: signal.Signals | None = None
    """Signal at which the process writes its stack to stderr; sent if it exceeds a time limit."""

    source = ""  # path of the tracker's Python code, whose last call is part of failures
    is_usable = True  # False while an answer is pending, and after a failure

    def __init__(
        self,
        command: Sequence[str],
        *,
        name: str = "",
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        files: Sequence[IO[bytes]] = (),
        paths: Sequence[TemporaryPath] = (),
    ) -> None:
        self.command = name or shlex.join(command)
        output = temporary_file()  # closed by `_end`
        self._output = output.fileno()
        fcntl.fcntl(self._output, fcntl.F_SETFL, os.O_APPEND)  # it is cut while both sides write
        try:
            tree = ProcessTree(
                command,
                environment,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=output,
                bufsize=0,
                pass_fds=[file.fileno() for file in files],
            )
        except (OSError, ValueError) as error:  # ValueError: a null character
            _close([output, *files, *paths])
            if fault := machine_fault(error):
                raise fault from error
            raise ExternalTrackerError(
                f"{self.command}: the command cannot be started: {error}. Check its path."
            ) from None
        self._process, stdin, stdout = tree.process, tree.process.stdin, tree.process.stdout
        assert stdin is not None
        assert stdout is not None
        self._end = weakref.finalize(self, _end, tree, [stdin, stdout, output, *files, *paths])
        self._stdin, self._stdout = stdin.fileno(), stdout.fileno()
        os.set_blocking(self._stdin, False)
        self._unread = bytearray()  # output of stdout

    def send(self, data: bytes, seconds: float) -> None:
        """Write bytes to the process; if it ends meanwhile, `read_line` reports it.

        Raises `ExternalTrackerError` if the process has failed before, or does not read all bytes
        within a number of seconds.
        """
        if not self._end.alive:  # its descriptor can belong to another file by now
            raise ExternalTrackerError(f"{self.command}: the process has ended.")
        unsent, limit = memoryview(data), monotonic() + seconds
        while True:
            try:
                unsent = unsent[os.write(self._stdin, unsent) :]
            except BlockingIOError:
                pass
            except BrokenPipeError:
                return
            if not unsent:
                return
            # Output is read meanwhile: otherwise, both processes could wait for each other.
            self._wait(limit, f"did not read its input in {seconds:g} s", sending=True)

    def read_line(self, seconds: float, mark: bytes = b"") -> bytes:
        """Return the next line of stdout that contains `mark`, without its line end.

        Other lines count as output for error messages.

        Raises `ExternalTrackerError` if the process ends, writes no such line within a number of
        seconds, or writes more than 64 MiB without a line end.
        """
        limit = monotonic() + seconds
        start = 0  # bytes before it have no line end
        while True:
            while (stop := self._unread.find(b"\n", start)) >= 0:
                line = bytes(self._unread[: stop + 1])
                del self._unread[: stop + 1]
                start = 0
                if mark in line:
                    return line.rstrip(b"\r\n")
                os.write(self._output, line)
            start = len(self._unread)
            self._wait(limit, f"did not answer in {seconds:g} s")

    def unread_line(self, mark: bytes) -> bytes:
        """Return a line that contains `mark` and that is already there; empty if there is none."""
        poller = select.poll()
        poller.register(self._stdout, select.POLLIN)
        if self._end.alive and poller.poll(0):
            self._unread += os.read(self._stdout, _CHUNK)
        lines = self._unread.splitlines(keepends=True)
        return next((bytes(line.rstrip()) for line in lines if mark in line), b"")

    def fail(self, problem: str) -> ExternalTrackerError:
        """End the process; return the error, whose text is the command and `problem`."""
        os.write(self._output, self._unread)
        start = max(0, os.fstat(self._output).st_size - _MAX_TAIL)
        output = os.pread(self._output, _MAX_TAIL, start).decode(errors="replace")
        output = output[-TAIL_CHARACTERS:].strip()
        self._end()
        self.is_usable = False
        text = f"{self.command}: the process {problem.removesuffix('.')}."
        last = _last_line(output, is_exception=self._process.returncode == 1)
        # Lists of failures show the first line. A stack starts with the innermost call.
        if stack := re.search(rf'File "{re.escape(self.source)}", line \d+ in .*', output):
            text += f" Its last call: {stack[0]}."
        elif last not in problem:
            text += f" Its last line: {last[:200]}"
        if output:
            text += f"\nThe end of its output:\n{output}"
        return ExternalTrackerError(text)

    def counters(self) -> ProcessCounters:
        """Return the counters of the process so far; they are 0 if the system has none."""
        process = self._process.pid
        try:
            schedstat = Path(f"/proc/{process}/schedstat").read_bytes()
            clock = (~process << 3) | 2  # CLOCK_PROCESS_CPUTIME_ID of another process, on Linux
            return ProcessCounters(int(schedstat.split()[1]) * 1e-9, clock_gettime(clock))
        except (OSError, IndexError):
            return ProcessCounters(0.0, 0.0)

    def close(self, seconds: float = 0.0) -> None:
        """End the process and all that it started, after up to `seconds` to end by itself."""
        if seconds and self._end.alive:
            assert self._process.stdin is not None
            self._process.stdin.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)
        self._end()

    def _wait(self, limit: float, problem: str, *, sending: bool = False) -> None:
        """Wait up to a second for output, and read it; if `sending`, also for room for input.

        Raises the error with the text `problem` after the time `limit`.
        """
        if monotonic() > limit:
            if self.stack_signal is not None:
                self._process.send_signal(self.stack_signal)
                sleep(_STACK_SECONDS)
            raise self.fail(problem)
        poller = select.poll()
        poller.register(self._stdout, select.POLLIN)
        if sending:
            poller.register(self._stdin, select.POLLOUT)
        ready = dict(poller.poll(1000 * min(max(0.0, limit - monotonic()), 1.0)))
        output = os.read(self._stdout, _CHUNK) if self._stdout in ready else None
        # A descendant that still runs can keep the streams of an ended process open.
        if output == b"" or (not ready and self._process.poll() is not None):
            raise self._ended()
        self._unread += output or b""
        if len(self._unread) > _MAX_OUTPUT:
            raise self.fail(f"wrote more than {_MAX_OUTPUT >> 20} MiB without a line end")
        if os.fstat(self._output).st_size > _MAX_OUTPUT:
            os.truncate(self._output, 0)

    def _ended(self) -> ExternalTrackerError:
        """Return the error for a process that has closed its stdout."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_EXIT_SECONDS)
        status = self._process.returncode
        if status is None:
            return self.fail("closed its stdout")
        if status < 0:
            return self.fail(f"ended by signal {-status} ({signal.strsignal(-status)})")
        return self.fail(f"ended with status {status}")


def _last_line(output: str, *, is_exception: bool) -> str:
    """Return the last line of a process's output that states a reason.

    Messages that Python writes while it exits are no reasons. If `is_exception`, the process may
    have ended by an exception of Python, whose message can have several lines: return the first.
    """
    output = _EXIT_MESSAGE.sub("", f"{output}\n")
    if is_exception and (exceptions := _EXCEPTION.findall(output)):
        return str(exceptions[-1])
    return output.strip().rpartition("\n")[2].strip()


def _end(tree: ProcessTree, files: Sequence[IO[bytes] | TemporaryPath]) -> None:
    tree.end()
    _close(files)


def _close(files: Sequence[IO[bytes] | TemporaryPath]) -> None:
    for file in files:
        file.close()
