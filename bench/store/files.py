"""Writing files so that a kill at any moment leaves the old file or the new one, whole."""

import os
import re
import socket
from collections.abc import Callable
from pathlib import Path

__all__ = ["ResultsError", "remove_leftovers", "write_atomically"]

_TEMPORARY = re.compile(r"^\.(?P<host>[^~]+)~(?P<process>\d+)~.*\.tmp$")


class ResultsError(ValueError):
    """Results that can't be read or written; the message names folder or file."""


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it to `path`.

    Raises
    ------
    ResultsError
        Where the file can't be written; nothing is left behind then.
    """
    temporary = path.parent / f".{_host()}~{os.getpid()}~{path.name}.tmp"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        _sync(temporary)
        temporary.replace(path)
        _sync(path.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True) if temporary.parent.is_dir() else None
        raise ResultsError(
            f"{path} can't be written: {error.strerror or error}. "
            "Make room or mend the permissions, or choose another folder with --output."
        ) from error


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of this machine's processes that are gone."""
    for file in folder.rglob(".*~*.tmp"):
        match = _TEMPORARY.match(file.name)
        if match and match["host"] == _host() and not _runs(int(match["process"])):
            file.unlink(missing_ok=True)


def _host() -> str:
    return socket.gethostname().replace("~", "-")


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # it runs, as another user
        return True
    return True


def _sync(path: Path) -> None:
    """Force a file's bytes, or a folder's names, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
