"""Frames of a run that has not ended, kept to see where it was when it died.

A NumPy array of 64-bit floats, a row a frame: x, y, width, height, visible (1 or 0),
confidence; NaN in frames that were not reached. It is mapped into memory, so that nothing
has to be written while the run goes on, and what was said last is there after any death of the
process. It is no result, and no reader of results looks at it.
"""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.lib.format import open_memmap
from numpy.typing import NDArray

from bench.store.files import write_atomically
from bench.store.layout import UNFINISHED

__all__ = ["map_rows", "read_rows", "unfinished_runs"]


def map_rows(path: Path, frames: int, columns: int) -> NDArray[np.float64]:
    """Make the file of a run, and map it into memory; an earlier one is replaced.

    Raises
    ------
    ResultsError
        Where it can't be written.
    """
    content = io.BytesIO()
    np.save(content, np.full((frames, columns), np.nan))
    # In full, though it says nothing yet: on a full disk a write fails, a mapping is fatal.
    write_atomically(path, content.getvalue(), durable=False)
    # As a plain array: a `memmap` costs microseconds at every access.
    return np.asarray(open_memmap(path, "r+"))


def read_rows(path: Path) -> NDArray[np.float64] | None:
    """Rows of an unfinished run; None where there are none, or a power cut left something else."""
    try:
        return np.load(path, allow_pickle=False) if path.is_file() else None
    except (OSError, EOFError, ValueError):  # it is not forced to the disk: see `map_rows`
        return None


def unfinished_runs(folder: Path) -> Iterator[tuple[Path, int, int]]:
    """Files of an experiment's unfinished runs, each with the frames it reached, and all frames.

    A run that is being made just now is among them.
    """
    for file in sorted(folder.glob(f"[!_.]*/*/*{UNFINISHED}")):
        rows = read_rows(file)
        if rows is not None:
            yield file, int(np.isfinite(rows[:, 0]).sum()), len(rows)
