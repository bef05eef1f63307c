"""What killed processes leave behind, and who removes it."""

import json
import os
import re
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as parquet

from bench.store.files import is_abandoned, locked, remove_empty_folder, remove_file
from bench.store.layout import METADATA_KEY, UNFINISHED
from bench.store.seal import read_sealed

__all__ = ["remove_leftovers"]

_COMPANION = re.compile(r"^(?P<run>\d+)\.[0-9a-f]{16}\.")


def remove_leftovers(folder: Path) -> None:
    """Remove from an experiment's folder what no process and no run needs any more.

    These are temporary files of this machine's processes that are gone; companions that no
    run names; frames of an unfinished run that was finished after all; and empty folders.

    Raises
    ------
    ResultsError
        Where one can't be removed, or a run is damaged.
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
