"""Writing files so that a kill or a full disk at any moment leaves the old or the new one, whole.

Every change that the store makes on disk is made here, by calls of `os`. A file's content is
made in memory, written under a temporary name, forced to the disk, and only then given its
own name.
"""

import errno
import fcntl
import os
import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache
from pathlib import Path

_TEMPORARY = re.compile(r"^\.(?P<host>[^~]+)~(?P<process>\d+)~.*\.tmp$")
_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EMLINK)
_ATTEMPTS = 3
_LOCK = ".lock"
_LOCK_SECONDS = 60.0
_LOCK_POLL_SECONDS = 0.02


class ResultsError(ValueError):
    """Results that can't be read or written; the message names folder or file."""


def unreadable(path: Path, error: OSError) -> ResultsError:
    """What is said of a file or folder that can't be read now, whatever stands in it."""
    return ResultsError(
        f"{path} can't be read: {error.strerror}. Mend the permissions or the disk, and run the "
        "same command again."
    )


def write_atomically(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Write a file, or replace it by another one.

    `path`: the file; its folder is made. `content`: what is to stand in it. `durable`: whether it
    is forced to the disk before its name says that it is there.

    Raises `ResultsError` where the file can't be written; the old one is still there then.
    """
    with _temporary(path, content, durable=durable) as temporary:
        os.replace(temporary, path)


def write_once(path: Path, content: bytes, lock: AbstractContextManager[None]) -> bool:
    """Write a file unless there is one already; what is there is never touched.

    `path`: the file. `content`: what is to stand in it. `lock`: entered where the file system has
    no hard links; see `locked`.

    Gives whether it was written.

    Raises `ResultsError` where the file can't be written.
    """
    with _temporary(path, content) as temporary:
        try:
            os.link(temporary, path)
        except FileExistsError:
            return False
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            with lock:
                if path.exists():
                    return False
                os.replace(temporary, path)
    return True


def append(path: Path, content: bytes) -> None:
    """Add to the end of a file, which is made where it is not there. Not forced to the disk.

    Raises `ResultsError` where it can't be written; nothing was added then.
    """
    try:
        descriptor = _open(path, os.O_APPEND)
        try:
            size = os.fstat(descriptor).st_size
            try:
                _write_all(descriptor, content)
            except OSError:
                os.ftruncate(descriptor, size)
                raise
        finally:
            os.close(descriptor)
    except OSError as error:
        raise _unwritable(path, error) from error


@contextmanager
def _temporary(path: Path, content: bytes, *, durable: bool = True) -> Iterator[Path]:
    """A file with this content beside `path`; once it has its name, that is on disk too."""
    temporary = path.with_name(temporary_name(f"{threading.get_native_id()}~{path.name}"))
    try:
        try:
            _write(temporary, content, durable=durable)
            yield temporary
        finally:
            with suppress(OSError):  # renamed, or the folder can't be written; see leftovers
                os.unlink(temporary)
        if durable:
            _sync_folder(path.parent)
    except OSError as error:
        raise _unwritable(path, error) from error


def remove_file(path: Path, *, durable: bool = True) -> None:
    """Remove a file, if it is there; `durable` as in `write_atomically`.

    Raises `ResultsError` where it can't be removed.
    """
    try:
        os.unlink(path)
        if durable:
            _sync_folder(path.parent)
    except FileNotFoundError:
        return
    except OSError as error:
        raise ResultsError(f"{path} can't be removed: {error.strerror or error}.") from error


def remove_empty_folder(path: Path) -> None:
    """Remove a folder in which nothing lies; leave any other."""
    with suppress(OSError):
        os.rmdir(path)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep out all other processes that lock the folder, on other machines too.

    The lock goes with the process that holds it.

    Raises `ResultsError` where the file system has no locks, or another process does not let go.
    """
    path = folder / _LOCK
    try:
        _make_folder(folder)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise _unwritable(path, error) from error
    try:
        _acquire(descriptor, path)
        yield
    finally:
        with suppress(OSError):  # the lock goes with the descriptor, whatever the system says
            os.close(descriptor)


def _acquire(descriptor: int, path: Path) -> None:
    deadline = time.monotonic() + _LOCK_SECONDS
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise ResultsError(
                    f"{path}: another process has held this lock for {_LOCK_SECONDS:.0f} s. "
                    "Is it stopped? End it, and run the same command again."
                ) from None
            time.sleep(_LOCK_POLL_SECONDS)
        except OSError as error:
            raise ResultsError(
                f"{path} can't be locked: {error.strerror}. Choose a folder on a file system "
                "with locks with --output."
            ) from error
        else:
            return


def temporary_name(name: str) -> str:
    """Name of a file that is of no use when this process is gone."""
    return f".{_host()}~{os.getpid()}~{name}.tmp"


def is_abandoned(name: str) -> bool:
    """Whether a file's name is a temporary one of a process of this machine that is gone."""
    match = _TEMPORARY.match(name)
    return bool(match and match["host"] == _host() and not _runs(int(match["process"])))


@cache
def _host() -> str:
    """Where process numbers mean the same: the machine, and in it the container."""
    name = socket.gethostname().replace("~", "-").replace("/", "-")
    space = Path("/proc/self/ns/pid")
    return f"{name}-{space.stat().st_ino}" if space.exists() else name


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # it runs, as another user
        return True
    try:  # killed, and nobody has asked yet how it ended: Linux
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return True
    return state != "Z"


def _make_folder(path: Path) -> None:
    """Make a folder and those above it, and force their names to the disk."""
    if path.is_dir():
        return
    _make_folder(path.parent)
    try:
        os.mkdir(path)
        _sync_folder(path.parent)
    except FileExistsError:
        # Another process was quicker, and may have removed it again meanwhile.
        if path.exists() and not path.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)) from None


def _open(path: Path, how: int) -> int:
    """Open a file for writing, in a folder that another process may find empty, and remove."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | how
    for _ in range(_ATTEMPTS):
        with suppress(FileNotFoundError):
            _make_folder(path.parent)
            return os.open(path, flags, 0o666)
    _make_folder(path.parent)
    return os.open(path, flags, 0o666)


def _write(path: Path, content: bytes, *, durable: bool) -> None:
    descriptor = _open(path, os.O_TRUNC)
    try:
        _write_all(descriptor, content)
        if durable:
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write_all(descriptor: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


def _unwritable(path: Path, error: OSError) -> ResultsError:
    return ResultsError(
        f"{path} can't be written: {error.strerror or error}. "
        "Make room or mend the permissions, or choose another folder with --output."
    )


def _sync_folder(path: Path) -> None:
    """Force a folder's names to the disk."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
