"""Features and errors of operating systems: memory, locks, processes, temporary files.

Everything that trackmark needs to work is in the standard library for all systems. The functions
here improve on that, each with a fallback: they limit memory, end processes with all their
descendants, and lock files.

Temporary files and folders with names are removed by a later start if their process is killed. The
owner of each path holds a lock, which the system releases when the owner ends, however it ends. A
path without a lock is therefore abandoned, also if its owner ran in another container.
"""

import ctypes
import errno
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import uuid
import weakref
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import IO, Any

try:
    import fcntl
    import resource
except ImportError:  # Windows
    fcntl = resource = None  # type: ignore[assignment]

_CONTROL_GROUP = Path("/sys/fs/cgroup/memory.max")
_DEATH_SIGNAL = 1  # Linux: PR_SET_PDEATHSIG
_SUBREAPER = 36  # Linux: PR_SET_CHILD_SUBREAPER
_KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
_END_SECONDS = 10.0

_MARK = "TRACKMARK_CHILD"
_HOME = str(Path(__file__).parents[2])  # folder of the package `trackmark`
# Import this installation, not another one that is earlier in the path.
_CODE = (
    "import sys; home = sys.argv.pop(1); home in sys.path or sys.path.insert(0, home); "
    "from {module} import main; main()"
)


def working_directory() -> str:
    """Return the working directory; empty if it was removed."""
    try:
        return os.getcwd()  # noqa: PTH109  # called for each frame: a Path takes longer
    except FileNotFoundError:
        return ""


@cache
def machine_name() -> str:
    """Return processor and number of cores of this machine: `AMD EPYC 7B13, 2 cores`."""
    cores = os.cpu_count() or 1
    return f"{_processor()}, {cores} core{'s' * (cores > 1)}"


def _processor() -> str:
    """Return the model of the processor, or else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
    except OSError:  # not Linux
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return " ".join(next(filter(None, models), platform.processor() or platform.machine()).split())


def machine_memory() -> int:
    """Return the memory of this machine or container [bytes]; 0 if the system does not tell it."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 0
    if _CONTROL_GROUP.is_file():
        allowed = _CONTROL_GROUP.read_text("utf-8").strip()
        if allowed != "max":
            memory = min(memory, int(allowed))
    return memory


def limit_memory(n_bytes: int) -> None:
    """Limit the data memory of this process, and of each child process; 0 sets no limit.

    An allocation beyond the limit raises `MemoryError`, or another error of the allocating library.
    Systems without such a limit set none.
    """
    if resource is not None and n_bytes:
        _, maximum = resource.getrlimit(resource.RLIMIT_DATA)
        allowed = n_bytes if maximum == resource.RLIM_INFINITY else min(n_bytes, maximum)
        resource.setrlimit(resource.RLIMIT_DATA, (allowed, maximum))


def max_open_files() -> float:
    """Return the number of files that this process may open; infinite if it is not limited."""
    if resource is None:
        return float("inf")
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return float("inf") if limit == resource.RLIM_INFINITY else limit


HAS_LOCKS = fcntl is not None
"""True if `lock_file` locks files, and if folders can be opened and locked like files."""


def lock_file(descriptor: int, *, wait: bool = True) -> None:
    """Lock a file, which only one process can do at a time, until its descriptor is closed.

    Without `wait`, raises `OSError` if another process has locked the file. Systems without such
    locks do nothing.
    """
    if fcntl is not None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def end_with_parent(parent: int) -> None:
    """Let the system kill this process when its parent ends.

    On other systems than Linux, the process has to notice that the parent has closed its pipe.
    """
    if sys.platform == "linux":
        # Orphaned processes of a tracker remain descendants of this process, and are ended with it.
        for option, value in ((_DEATH_SIGNAL, _KILL), (_SUBREAPER, 1)):
            ctypes.CDLL(None).prctl(option, value)
        if os.getppid() != parent:  # the parent has ended in the meantime
            os._exit(1)


def in_child() -> bool:
    """Return whether trackmark has started this process, directly or indirectly."""
    return any(name.startswith(f"{_MARK}_") for name in os.environ)


class ProcessTree:
    """Process of a command, in its own session; `process` is an object of `subprocess.Popen`.

    `environment` is added to the environment of this process. `options` are further arguments of
    `subprocess.Popen`.
    """

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str] | None = None, **options: Any
    ) -> None:
        # Each tree has its own variable, so that nested trees do not hide one another.
        self._mark = f"{_MARK}_{uuid.uuid4().hex}"
        self.process: subprocess.Popen[bytes] = subprocess.Popen(  # noqa: S603  # by the user
            command,
            env={**os.environ, **(environment or {}), self._mark: "1"},
            # In its own session, the process does not receive signals for this command.
            start_new_session=True,
            **options,
        )

    @classmethod
    def run_module(cls, module: str, arguments: Iterable[object], **options: Any) -> "ProcessTree":
        """Call `main` of a module in a new process, with `arguments` in `sys.argv`."""
        code = _CODE.format(module=module)
        command = [sys.executable, "-P", "-c", code, _HOME, *map(str, arguments)]
        return cls(command, **options)

    def end(self) -> None:
        """Kill the process and all processes that it has started.

        Where descendants cannot be found, they end when their pipes to the process close.
        """
        process = self.process
        if hasattr(signal, "SIGSTOP"):
            process.send_signal(signal.SIGSTOP)  # a stopped process cannot start others
        for descendant in _descendants(process.pid, self._mark):
            with suppress(ProcessLookupError):
                os.kill(descendant, _KILL)
        with suppress(ProcessLookupError, PermissionError):  # the process or session has ended
            if hasattr(os, "killpg"):
                os.killpg(process.pid, _KILL)
            process.send_signal(_KILL)
            if hasattr(signal, "SIGCONT"):
                process.send_signal(signal.SIGCONT)  # a stopped process does not handle SIGTERM
        with suppress(subprocess.TimeoutExpired):  # waits for a lost disk
            process.wait(_END_SECONDS)


def _descendants(parent: int, mark: str) -> list[int]:
    """Return the ids of a process's descendants, from `/proc`; none on systems without it.

    A descendant is missed if its environment lacks the mark and its ancestors have ended.
    """
    parents: dict[int, int] = {}
    descendants: set[int] = set()
    assignment = f"{mark}=1".encode()
    folders: list[Path] = []
    with suppress(OSError):  # there is no such folder
        folders = list(Path("/proc").glob("[0-9]*"))
    for folder in folders:
        with suppress(OSError):  # the process has ended, or belongs to another user
            process = int(folder.name)
            state = (folder / "stat").read_text("utf-8", "replace")
            parents[process] = int(state.rpartition(")")[2].split()[1])
            if assignment in (folder / "environ").read_bytes().split(b"\0"):
                descendants.add(process)
    newer = {parent, *descendants}
    while newer := {child for child, creator in parents.items() if creator in newer} - descendants:
        descendants |= newer
    return sorted(descendants - {parent})


MIN_OPEN_FILES = 128
"""Number of open files that a process needs in any case; a process can be limited to fewer."""

_ADVICE = {
    errno.ENOSPC: "Free some space",
    errno.EDQUOT: "Free some space",
    errno.EROFS: "Make the file system writable, or choose another folder",
    errno.ENFILE: "End other processes",
    errno.EMFILE: f"Raise the limit of open files, for example by `ulimit -n {8 * MIN_OPEN_FILES}`",
}


class MachineError(Exception):
    """Error of the machine: a full or write-protected disk, or too few open files.

    It is no `OSError` or `ValueError`: it must not be caught as an error of a file or a tracker.
    """


def machine_fault(error: BaseException) -> MachineError | None:
    """Return the error of the machine that an exception, or one of its causes, reports.

    Too many open files are such an error only if the limit of this process is very low. Otherwise,
    a tracker has opened them.
    """
    seen = set[int]()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        seen.add(id(cause))
        if isinstance(cause, MachineError):
            return cause
        if isinstance(cause, OSError) and cause.errno in _ADVICE:
            code = cause.errno
            if code != errno.EMFILE or max_open_files() < MIN_OPEN_FILES:
                location = "" if cause.filename is None else f"{cause.filename}: "
                reason = os.strerror(code)
                return MachineError(f"{location}{reason}. {_ADVICE[code]}, and start again.")
        cause = cause.__cause__ or cause.__context__
    return None


def no_room(reason: str) -> MachineError:
    """Return the error for temporary files that cannot be written."""
    return MachineError(
        f"there is no space for temporary files ({reason}). Free some space, or set the "
        "environment variable TMPDIR to another folder."
    )


def temporary_file() -> IO[bytes]:
    """Return an unnamed temporary file, which the system deletes after its last use.

    Raises `MachineError` if it cannot be created.
    """
    try:
        file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  # the caller closes it
    except OSError as error:
        if error.errno in (errno.EMFILE, errno.ENFILE):
            raise MachineError(f"{error.strerror}. {_ADVICE[error.errno]}.") from error
        raise no_room(error.strerror or str(error)) from error
    return file


TEMPORARY_PREFIX = "trackmark-temporary-"
"""Start of the names of temporary paths."""

FRAME_FOLDER = "/dev/shm" if os.access("/dev/shm", os.W_OK) else tempfile.gettempdir()  # noqa: S108  # names in it are random
"""Folder of the files with the frames of trackers in other processes: in memory if possible."""

FRAME_PREFIX = "trackmark-frames-"
"""Start of the names of these files."""


class TemporaryPath:
    """Temporary folder, or file if `is_file`, that this process owns until `close`.

    `folder`: its parent, by default the system's folder for temporary files. `prefix` and `suffix`:
    start and end of its name. Abandoned paths with this prefix are removed from the parent.
    """

    def __init__(
        self,
        folder: str | Path | None = None,
        prefix: str = TEMPORARY_PREFIX,
        suffix: str = "",
        *,
        is_file: bool = False,
    ) -> None:
        folder = Path(folder or tempfile.gettempdir())
        remove_abandoned(folder, prefix)
        is_locked, lock = False, None
        while not is_locked:  # another process can remove the path before it is locked
            if is_file:
                descriptor, name = tempfile.mkstemp(suffix, prefix, folder)
                os.close(descriptor)
            else:
                name = tempfile.mkdtemp(suffix, prefix, folder)
            lock = _lock(Path(name), wait=True)
            is_locked = lock is not None or not HAS_LOCKS
        self.path = Path(name)
        self.close = weakref.finalize(self, _remove, self.path, lock)


@contextmanager
def temporary_folder(
    folder: str | Path | None = None, prefix: str = TEMPORARY_PREFIX
) -> Iterator[Path]:
    """Yield a temporary folder; see `TemporaryPath`."""
    owned = TemporaryPath(folder, prefix)
    try:
        yield owned.path
    finally:
        owned.close()


def remove_abandoned(folder: Path, prefix: str = TEMPORARY_PREFIX) -> None:
    """Remove the temporary paths of a folder whose owners have ended without removing them."""
    with suppress(OSError), os.scandir(folder) as entries:
        paths = [Path(entry.path) for entry in entries if entry.name.startswith(prefix)]
        for path in paths:
            if (lock := _lock(path)) is not None:
                _remove(path, lock)


def _lock(path: Path, *, wait: bool = False) -> int | None:
    """Return a descriptor that locks a path; None if another process has locked or removed it.

    On systems without locks, the result is None, so that no path counts as abandoned.
    """
    if not HAS_LOCKS:
        return None
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:  # removed, or of another user
        return None
    try:
        lock_file(descriptor, wait=wait)
        if os.path.samestat(os.fstat(descriptor), path.lstat()):
            return descriptor
    except FileNotFoundError:
        pass
    except OSError:  # locked; or the file system has no locks, so that no path is removed
        if wait:
            return descriptor
    os.close(descriptor)
    return None


def _remove(path: Path, lock: int | None) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):  # deleted by another program, or of another user
            path.unlink()
    if lock is not None:
        os.close(lock)
