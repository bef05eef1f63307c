"""The error of the store, and atomic writing of single files."""

import os
from pathlib import Path
from tempfile import NamedTemporaryFile


class ResultsError(ValueError):
    """Results cannot be read or written; the message names folder or file."""


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file, or replace it. After a crash, either the old or the new file is complete.

    `path`: file; a missing folder is created. `content`: new content of the file.

    Raises `ResultsError` if the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            try:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                Path(file.name).chmod(0o644)
                Path(file.name).replace(path)
            except BaseException:
                Path(file.name).unlink()
                raise
    except OSError as error:
        raise ResultsError(
            f"{path} cannot be written: {error.strerror or error}. Make room, correct the "
            "permissions, or choose another folder with --output."
        ) from error
