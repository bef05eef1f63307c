"""Atomic replacement of the files that a user names, and file names for labels."""

import hashlib
import os
import shutil
import stat
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from trackmark.bench.operating_system import temporary_folder

_MAX_NAME_LENGTH = 200  # bytes, up to four per character; file systems allow 255


def write_file(path: Path, output: str | bytes | Callable[[Path], object]) -> Path:
    """Write text, bytes, or what a function writes to the file that it gets; return `path`.

    A file is replaced atomically: after an error, an interrupt or a power failure it has the old or
    the new content. The permissions of the old file are kept. If `path` is a symbolic link, its
    target is replaced. Content for a device, a FIFO or the standard output is written directly.

    Raises
    ------
    OSError
        If the file cannot be written. `filename` is `path`.
    """
    write = output if callable(output) else partial(_write, output)
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


def _write(output: str | bytes, file: Path) -> None:
    file.write_bytes(output if isinstance(output, bytes) else output.encode())


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
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
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
        with temporary.open("rb") as written:
            shutil.copyfileobj(written, output)


def _standard_stream(status: os.stat_result) -> int | None:
    """Return the descriptor of the standard output or error that is this file."""
    for descriptor in (1, 2):
        try:
            if os.path.samestat(status, os.fstat(descriptor)):
                return descriptor
        except OSError:  # closed
            continue
    return None


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Return file names by label: characters except letters, digits, dots and dashes become dashes.

    Names that are too long, or equal except for case, end in a digest.
    """
    names = {
        label: "".join(sign if sign.isalnum() or sign in ".-" else "-" for sign in label)
        for label in labels
    }
    equal = Counter(name.casefold() for name in names.values())
    for label, name in names.items():
        if equal[name.casefold()] > 1 or len(name.encode()) > _MAX_NAME_LENGTH:
            digest = hashlib.sha256(label.encode("utf-8", "surrogateescape")).hexdigest()[:6]
            names[label] = f"{name[: _MAX_NAME_LENGTH // 4]}-{digest}"
    return names
