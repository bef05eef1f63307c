"""Which runs lie in an experiment's folder: names, sizes and times, no file is opened."""

import os
import re
from array import array
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow as pa

from bench.store.columns import coded
from bench.store.files import ResultsError

__all__ = ["list_runs"]

_RUN = re.compile(r"(0|[1-9]\d*)\.parquet")


def list_runs(folder: Path) -> pa.Table:
    """Runs in an experiment's folder, in order.

    Returns
    -------
    Table
        `tracker_folder`, `sequence_folder`, `repetition`, `size` [bytes] and `mtime`
        [nanoseconds], a row a run.

    Raises
    ------
    ResultsError
        For a Parquet file that is called like no run.
    """
    sequences: dict[str, int] = {}
    trackers = sorted(_folders(folder))
    columns = {name: array("q") for name in ("t", "s", "repetition", "size", "mtime")}
    for number, tracker in enumerate(trackers):
        for sequence in sorted(_folders(folder / tracker)):
            here = sequences.setdefault(sequence, len(sequences))
            for row in sorted(_runs(folder / tracker / sequence)):
                for column, value in zip(columns.values(), (number, here, *row), strict=True):
                    column.append(value)
    found = {name: np.frombuffer(values, np.int64) for name, values in columns.items()}
    return pa.table(
        {
            "tracker_folder": coded(trackers, found["t"]),
            "sequence_folder": coded(list(sequences), found["s"]),
            "repetition": found["repetition"].astype(np.int32),
            "size": found["size"],
            "mtime": found["mtime"],
        }
    )


def _folders(folder: Path) -> Iterator[str]:
    for entry in _entries(folder):
        if entry.name[0] not in "_." and entry.is_dir():
            yield entry.name


def _runs(folder: Path) -> Iterator[tuple[int, int, int]]:
    """Repetition, size and time of change; what is removed meanwhile is left out."""
    for entry in _entries(folder):
        if not entry.name.endswith(".parquet"):
            continue
        name = _RUN.fullmatch(entry.name)
        if name is None:
            raise ResultsError(
                f"{folder / entry.name} is called like no run (a number and .parquet). "
                "Move it elsewhere."
            )
        with suppress(FileNotFoundError):
            status = entry.stat()
            yield int(name[1]), status.st_size, status.st_mtime_ns


def _entries(folder: Path) -> "Iterator[os.DirEntry[str]]":
    """What lies in a folder; nothing in one that is not there."""
    try:
        with os.scandir(folder) as entries:
            yield from entries
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise ResultsError(
            f"{folder} can't be read: {error.strerror}. Mend the permissions or the disk, and run "
            "the same command again."
        ) from error
