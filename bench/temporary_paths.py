"""Temporary files and folders with names, which a later start removes if their process is killed.

The owner of each path holds a lock, which the system releases when the owner ends, however it ends.
A path without a lock is therefore abandoned, also if its owner ran in another container.
"""

import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from trackmark.bench.operating_system import HAS_LOCKS, lock_file

PREFIX = "trackmark-temporary-"
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
        prefix: str = PREFIX,
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
def temporary_folder(folder: str | Path | None = None, prefix: str = PREFIX) -> Iterator[Path]:
    """Yield a temporary folder; see `TemporaryPath`."""
    owned = TemporaryPath(folder, prefix)
    try:
        yield owned.path
    finally:
        owned.close()


def remove_abandoned(folder: Path, prefix: str = PREFIX) -> None:
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
