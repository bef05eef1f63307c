"""Exception class of the store, and atomic writing of files."""

import os
from pathlib import Path
from tempfile import NamedTemporaryFile


class ResultsError(ValueError):
    """Error in reading or writing results; the message names the folder or file."""


def write_atomically(path: Path, content: bytes) -> None:
    """Write or replace a file such that after a crash, the old or the new file is complete.

    A missing folder is created.

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
            f"{path} cannot be written: {error.strerror or error}. Free disk space, correct the "
            "permissions, or choose another folder with --output."
        ) from error
