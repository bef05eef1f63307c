"""Errors of the machine, such as a full disk, which are no failures of a tracker or a sequence."""

import errno
import os
import tempfile
from typing import IO

from trackmark.bench.operating_system import max_open_files

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
