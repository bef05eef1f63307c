"""Atomic replacement of the files that a user names."""

import os
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

from trackmark.reports.temporary_paths import temporary_folder


def write_file(path: Path, write: Callable[[Path], object]) -> Path:
    """Call `write` with a temporary file, move its content to `path`, and return `path`.

    A file is replaced atomically: after an error, an interrupt or a power failure it has the old or
    the new content. The permissions of the old file are kept. If `path` is a symbolic link, its
    target is replaced. Content for a device, a FIFO or the standard output is written directly.

    Raises
    ------
    OSError
        If the file cannot be written. `filename` is `path`.
    """
    try:
        try:
            status = path.stat()
        except FileNotFoundError:
            status = None
        if status is None or (stat.S_ISREG(status.st_mode) and _standard_stream(status) is None):
            _replace(Path(os.path.realpath(path)), path.name, write, status)
        else:
            _fill(path, write, status)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OSError(error.errno, f"cannot write ({reason})", str(path)) from error
    return path


def _replace(
    target: Path, name: str, write: Callable[[Path], object], status: os.stat_result | None
) -> None:
    """Replace the file `target`; `status`: that of the existing file, None if there is none."""
    if status is not None and not os.access(target, os.W_OK):
        target.open("ab").close()  # raises `OSError`; replacing would ignore the write protection
    target.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(target.parent, ".trackmark-temporary-") as folder:
        temporary = folder / name  # `write` may choose the format by the suffix
        write(temporary)
        if status is not None:
            temporary.chmod(stat.S_IMODE(status.st_mode))
        with temporary.open("rb") as content:
            os.fsync(content.fileno())
        temporary.replace(target)


def _fill(path: Path, write: Callable[[Path], object], status: os.stat_result) -> None:
    """Write to a file that cannot be replaced."""
    stream = _standard_stream(status)
    with (
        # Opened first, so that a folder is refused before the work of `write`.
        path.open("wb") if stream is None else open(stream, "wb", closefd=False) as output,
        temporary_folder() as folder,
    ):
        temporary = folder / path.name  # some writers seek, which a FIFO cannot
        write(temporary)
        with temporary.open("rb") as content:
            shutil.copyfileobj(content, output)


def _standard_stream(status: os.stat_result) -> int | None:
    """Return the descriptor of the standard output or error that is this file."""
    for descriptor in (1, 2):
        try:
            if os.path.samestat(status, os.fstat(descriptor)):
                return descriptor
        except OSError:  # closed
            continue
    return None
