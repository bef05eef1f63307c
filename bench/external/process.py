"""Child process that exchanges lines with the harness, on all platforms in the same way.

Threads read the output of the process, because a pipe cannot be read with a time limit on Windows.
"""

import re
import shlex
import signal
import subprocess
import threading
import time
import traceback
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import IO, NamedTuple

from trackmark.bench.operating_system import ProcessTree, TemporaryPath, machine_fault
from trackmark.trackers import TrackerError
from trackmark.trackers.base.estimate_check import MalformedEstimateError

TAIL_CHARACTERS = 2_000
"""Number of characters of a process's output that an error repeats."""

END = b""
"""Line that stands for the end of the output."""

_MAX_LINE = 1 << 26  # bytes
_MAX_TAIL = 4 * TAIL_CHARACTERS  # bytes; a character has at most 4
_WAIT_SECONDS = 0.5  # between checks whether the process still runs
_STACK_SECONDS = 1.0  # in which a stack is written
_EXIT_SECONDS = 5.0  # between the end of the output and the end of the process
_DRAIN_SECONDS = 1.0  # in which the last output of an ended process is read
_READY_SECONDS = 0.05  # in which a process waits for the next request after its answer
_CHUNK = 1 << 16
_PIPE_BYTES = 4096  # that a pipe takes without waiting for its reader

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
    """Failure of a tracker's process: one line with the reason, then the end of its output."""


class LineProcess:
    """Process that is controlled by lines on its stdin and stdout.

    Of other output (stderr, and lines of stdout without `mark`), the end is kept; failures repeat
    it. `close`, failures, the garbage collector and the end of this process end the
    process and all that it started.

    `command` is the program with its arguments; no shell is used. `name` replaces the command in
    errors. `environment` has variables in addition to those of this process; `folder` is the
    working directory. When the process has ended, `files` are closed, and temporary ones
    removed.

    Raises `ExternalTrackerError` if the command cannot be started.
    """

    stack_signal: signal.Signals | None = None
    """Signal at which the process writes its stack to stderr; sent if it exceeds a time limit."""

    source = ""  # path of the tracker's Python code, whose last call is part of failures
    is_usable = True  # False while an answer is pending, and after a failure

    def __init__(
        self,
        command: Sequence[str],
        mark: bytes,
        *,
        name: str = "",
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        files: Sequence[IO[bytes] | TemporaryPath] = (),
    ) -> None:
        self.command = name or shlex.join(command)
        try:
            tree = ProcessTree(
                command,
                environment,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
            )
        except (OSError, ValueError) as error:  # ValueError: a null character
            _close(files)
            if fault := machine_fault(error):
                raise fault from error
            raise ExternalTrackerError(
                f"{self.command}: the command cannot be started: {error}. Check its path."
            ) from None
        self.process, stdin = tree.process, tree.process.stdin
        assert stdin is not None
        self._stdin = stdin
        self._lines: SimpleQueue[bytes] = SimpleQueue()
        self._output = _Output()
        # The threads keep no reference to this object, which the garbage collector can then end.
        self._readers = [
            _start_thread(_read_lines, tree.process.stdout, mark, self._output, self._lines),
            _start_thread(_read_output, tree.process.stderr, self._output),
        ]
        self._end = weakref.finalize(self, _end, tree, [stdin, *files])

    def send(self, message: bytes, seconds: float) -> None:
        """Write bytes to the process; if it ends meanwhile, `read_line` reports it.

        Raises `ExternalTrackerError` if the process has failed before, or does not read all bytes
        within a number of seconds.
        """
        if not self._end.alive:
            raise ExternalTrackerError(f"{self.command}: the process has ended.")
        late, timer = threading.Event(), None
        if len(message) > _PIPE_BYTES:
            timer = threading.Timer(seconds, _give_up, [self.process, late])
            timer.daemon = True
            timer.start()
        unsent = memoryview(message)
        with suppress(OSError):  # the process has ended
            while unsent:
                unsent = unsent[self._stdin.write(unsent) :]
        if timer is not None:
            timer.cancel()
        if late.is_set():
            raise self.fail(f"did not read its input in {seconds:g} s")

    def read_line(self, seconds: float) -> bytes:
        """Return the next marked line of stdout, from the mark on and without its line end.

        Raises `ExternalTrackerError` if the process ends, writes no such line within a number of
        seconds, or writes more than 64 MiB without a line end.
        """
        limit = monotonic() + seconds
        while True:
            left = limit - monotonic()
            # A descendant that still runs can keep the streams of an ended process open.
            has_ended = self.process.poll() is not None
            with suppress(Empty):
                line = self._lines.get(timeout=min(max(0.0, left), _WAIT_SECONDS))
                if line == END:
                    raise self._ended()
                return line
            if has_ended:
                raise self._ended()
            if left < 0:
                if self.stack_signal is not None:
                    self.process.send_signal(self.stack_signal)
                    sleep(_STACK_SECONDS)
                raise self.fail(f"did not answer in {seconds:g} s")

    def unread_line(self) -> bytes:
        """Return a marked line that is already there; empty if there is none."""
        with suppress(Empty):
            return self._lines.get_nowait()
        return b""

    def fail(self, problem: str) -> ExternalTrackerError:
        """End the process; return the error, whose text is the command and `problem`."""
        output = self.end_output()
        if self._output.is_too_long:
            problem = f"wrote more than {_MAX_LINE >> 20} MiB without a line end"
        message = f"{self.command}: the process {problem.removesuffix('.')}."
        last = _last_line(output, is_exception=self.process.returncode == 1)
        # Lists of failures show the first line. A stack starts with the innermost call.
        source = self.source.encode("ascii", "backslashreplace").decode()  # as in `faulthandler`
        if stack := re.search(rf'File "{re.escape(source)}", line \d+ in .*', output):
            message += f" Its last call: {stack[0]}."
        elif last not in problem:
            message += f" Its last line: {last[:200]}"
        return ExternalTrackerError(with_output(message, output))

    def printed(self) -> str:
        """Return the end of the output since the last call of `forget_output`."""
        return self._output.last_characters()

    def forget_output(self) -> None:
        """Forget the output of a tracker, because the process runs another one next."""
        self._output.clear()

    def end_output(self) -> str:
        """End the process; return the end of its output."""
        self._end()
        self.is_usable = False
        for reader in self._readers:
            reader.join(_DRAIN_SECONDS)
        return self._output.last_characters().strip()

    def counters(self) -> ProcessCounters:
        """Return the counters of the process so far; they are 0 if the system has none."""
        process = self.process.pid
        try:
            schedstat = Path(f"/proc/{process}/schedstat").read_bytes()
            clock = (~process << 3) | 2  # CLOCK_PROCESS_CPUTIME_ID of another process, on Linux
            return ProcessCounters(int(schedstat.split()[1]) * 1e-9, time.clock_gettime(clock))
        except (OSError, IndexError):
            return ProcessCounters(0.0, 0.0)

    def wait_until_ready(self) -> None:
        """Wait until the main thread of the process waits, for up to `_READY_SECONDS`.

        Otherwise, the counters of the next request would contain the run delay of before: Linux
        counts a delay when it ends.
        """
        status, until = Path(f"/proc/{self.process.pid}/stat"), monotonic() + _READY_SECONDS
        with suppress(OSError):  # the process has ended, or the system is not Linux
            # The name of the program, in brackets, can contain any character.
            while b") R" in status.read_bytes() and monotonic() < until:
                sleep(_READY_SECONDS / 1000)

    def close(self, seconds: float = 0.0) -> None:
        """End the process and all that it started, after up to `seconds` to end by itself."""
        if seconds and self._end.alive:
            self._stdin.close()
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(seconds)
        self._end()

    def _ended(self) -> ExternalTrackerError:
        """Return the error for a process that has closed its stdout."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_EXIT_SECONDS)
        status = self.process.returncode
        if status is None:
            return self.fail("closed its stdout")
        if status < 0:
            return self.fail(f"ended by signal {-status} ({signal.strsignal(-status)})")
        return self.fail(f"ended with status {status}")


def _give_up(process: subprocess.Popen[bytes], late: threading.Event) -> None:
    late.set()
    process.kill()


class _Output:
    """End of the output of a process; two threads add to it."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.is_too_long = False  # a line of stdout

    def add(self, output: bytes | bytearray) -> None:
        """Add output, and drop what is older than the end that is kept."""
        self._bytes.extend(output)
        del self._bytes[:-_MAX_TAIL]

    def clear(self) -> None:
        """Forget the output."""
        self._bytes.clear()

    def last_characters(self) -> str:
        """Return the last characters."""
        return self._bytes.decode(errors="replace")[-TAIL_CHARACTERS:]


def _start_thread(target: Callable[..., None], *arguments: object) -> threading.Thread:
    thread = threading.Thread(target=target, args=arguments, daemon=True)
    thread.start()
    return thread


def _read_lines(
    stdout: IO[bytes], mark: bytes, output: _Output, marked: "SimpleQueue[bytes]"
) -> None:
    """Put marked lines and then `END` into a queue; add other lines to the output."""
    unread = bytearray()
    with stdout:
        while chunk := stdout.read(_CHUNK):
            unread += chunk
            if b"\n" in chunk:
                *lines, unread = unread.split(b"\n")
                for line in lines:
                    if (start := line.find(mark)) >= 0:
                        marked.put(bytes(line[start:].rstrip(b"\r")))
                    else:
                        output.add(line + b"\n")
            elif len(unread) > _MAX_LINE:
                output.is_too_long = True
                break
        output.add(unread)
    marked.put(END)


def _read_output(stderr: IO[bytes], output: _Output) -> None:
    with stderr:
        while chunk := stderr.read(_CHUNK):
            output.add(chunk)


def with_output(message: str, output: str) -> str:
    """Return the text of a failure with the end of the output, if there is any."""
    return f"{message}\nThe end of its output:\n{output}" if output else message


def exception_text(error: BaseException) -> str:
    """Return type and message of an exception as one line; of trackers' own errors the message."""
    # The module traceback also handles exceptions whose `__str__` fails.
    text = " ".join(traceback.format_exception_only(error)).strip().replace("\n", " ")
    text = text.removeprefix(f"{type(error).__module__}.")
    if type(error) in (MalformedEstimateError, TrackerError):  # the message suffices
        text = text.removeprefix(f"{type(error).__name__}: ")
    return text


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
