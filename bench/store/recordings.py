"""Recorded data by the names that runs on them are filed under: no two of one name in a folder.

Data that were changed where they lie are the same data still, and runs on them stale. Data of
another place that are not equal are others, whatever they are called.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa


class Recording(NamedTuple):
    """Recorded data that runs were made on."""

    fingerprint: str  # as `datasets.Sequence` has it
    source: str  # path that it was opened from
    truth: str  # path of its truth, where that was given; else empty

    def __str__(self) -> str:
        return f"{self.source} with the truth {self.truth}" if self.truth else self.source

    @property
    def place(self) -> tuple[str, str]:
        """Where it lies, however that was written."""
        return os.path.realpath(self.source), self.truth and os.path.realpath(self.truth)


def recordings(index: pa.Table) -> dict[str, set[Recording]]:
    """Recorded data in an index, by the names of their sequences."""
    keys = ["sequence", *Recording._fields]
    found: dict[str, set[Recording]] = {}
    for row in index.group_by(keys).aggregate([]).to_pylist():
        if Path(row["source"]).is_absolute():  # built-in sequences have names
            one = Recording(*(row[key] for key in Recording._fields))
            found.setdefault(row["sequence"], set()).add(one)
    return found


def different(one: Recording, others: Iterable[Recording]) -> Recording | None:
    """Some of the others that is other data than this; None where there is none."""
    for other in others:
        if other.fingerprint != one.fingerprint and other.place != one.place:
            return other
    return None
