"""Frames of a run that has not ended, kept to see where it was when it died.

A NumPy array of 64-bit floats, a row a frame: x, y, width, height, visible (1 or 0),
confidence; NaN in frames that were not reached. It is mapped into memory, so that nothing
has to be written while the run goes on, and what was said last is there after any death of the
process. It is no result, and no reader of results looks at it.
"""

import io
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from numpy.lib.format import open_memmap
from numpy.typing import NDArray

from trackmark.bench.store.checksum import read_sealed
from trackmark.bench.store.files import (
    is_abandoned,
    locked,
    remove_empty_folder,
    remove_file,
    write_atomically,
)
from trackmark.bench.store.layout import METADATA_KEY, UNFINISHED

_COMPANION = re.compile(r"^(?P<run>\d+)\.[0-9a-f]{16}\.")


def map_rows(path: Path, frames: int, columns: int) -> NDArray[np.float64]:
    """Make the file of a run, and map it into memory; an earlier one is replaced.

    Raises `ResultsError` where it can't be written.
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


def remove_leftovers(folder: Path) -> None:
    """Remove from an experiment's folder what no process and no run needs any more.

    These are temporary files of this machine's processes that are gone; companions that no
    run names; frames of an unfinished run that was finished after all; and empty folders.

    Raises `ResultsError` where one can't be removed, or a run is damaged.
    """
    orphans: list[tuple[Path, str]] = []
    for place, _, names in os.walk(folder, topdown=False):
        if not names:  # whatever folders were in it
            remove_empty_folder(Path(place))
        for name in names:
            if name.endswith(".parquet"):
                continue
            file = Path(place, name)
            if is_abandoned(name) or (name.endswith(UNFINISHED) and _was_finished(file)):
                remove_file(file, durable=False)
            elif companion := _COMPANION.match(name):
                orphans.append((file, f"{companion['run']}.parquet"))
    if orphans:
        # Under the lock: companions of a run that is just being written wait for it.
        with locked(folder):
            for file, run in orphans:
                if file.name not in _named_by(file.with_name(run)):
                    remove_file(file, durable=False)
                    remove_empty_folder(file.parent)
                    remove_empty_folder(file.parent.parent)


def _was_finished(file: Path) -> bool:
    run = file.with_name(file.name.removesuffix(UNFINISHED) + ".parquet")
    return run.is_file() and run.stat().st_mtime_ns >= file.stat().st_mtime_ns


def _named_by(run: Path) -> set[str]:
    """Names of a run's companions."""
    if not run.is_file():
        return set()
    metadata = parquet.read_schema(pa.BufferReader(read_sealed(run))).metadata
    return set(json.loads(metadata[METADATA_KEY])["companions"].values())
