"""Writing a report's files: whole or not at all."""

import os
from collections.abc import Callable
from pathlib import Path

__all__ = ["write_file"]


def write_file(path: Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside `path`, rename it to `path`, and give that.

    Whatever ends it, an interrupt or a damaged frame too, leaves `path` as it was and nothing
    beside it.

    Raises
    ------
    OSError
        Where it can't be written; the message names the file.
    """
    # The suffix stays the last part of the name: writers choose the format by it.
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        raise OSError(error.errno, f"{path} can't be written: {error.strerror or error}") from error
    finally:
        if temporary.parent.is_dir():
            temporary.unlink(missing_ok=True)
    return path
