"""Rows of the index: what plans and reports know of a run, and what it scores."""

import json
from collections.abc import Iterable, Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

import pyarrow as pa

from bench.evaluation.record import Run
from bench.evaluation.scoring import score_both
from bench.store.columns import TEXT
from bench.store.layout import run_path
from bench.store.results import Results
from bench.store.truth import read_truth

__all__ = [
    "BATCH",
    "FIELDS",
    "for_json",
    "index_row",
    "index_rows",
    "index_table",
    "row_of_file",
]

_TEXTS = (
    "tracker",
    "tracker_name",
    "preset",
    "parameters",
    "version",
    "sequence",
    "fingerprint",
    "protocol",
    "status",
    "failure",
    "source",
    "truth",
)
FIELDS = pa.schema(
    [
        *((name, TEXT) for name in _TEXTS),
        ("repetition", pa.int32()),
        ("frames", pa.int32()),
        ("size", pa.int64()),
        ("mtime", pa.int64()),
        ("seconds", pa.float64()),
        ("frame_seconds", pa.float64()),
    ]
)
BATCH = 4096
"""Rows that are held as Python objects at a time."""


def index_row(results: Results, path: Path, run: Run, truth: Any) -> dict[str, Any]:
    """The index's row of a run that lies in `path`."""
    key = run.identity
    status = path.stat()
    return {
        "path": str(path.relative_to(results.folder)),
        "tracker": key.tracker,
        "tracker_name": key.tracker_name,
        "preset": key.preset,
        "parameters": json.dumps(key.parameters, sort_keys=True),
        "version": key.version,
        "sequence": key.sequence,
        "fingerprint": key.fingerprint,
        "protocol": key.protocol,
        "status": run.status,
        "failure": run.failure,
        "source": run.circumstances.get("source", ""),
        "truth": run.circumstances.get("truth", ""),
        "repetition": key.repetition,
        "frames": len(run.boxes),
        "size": status.st_size,
        "mtime": status.st_mtime_ns,
        "seconds": run.circumstances.get("seconds"),
        "frame_seconds": run.circumstances.get("frame_seconds"),
        "scores": {} if run.failure else score_both(run, truth),
    }


def row_of_file(results: Results, file: Path) -> dict[str, Any]:
    """The index's row of a run as it lies on disk, scored by the truth that it was made with.

    Raises
    ------
    ResultsError
        Naming a file that can't be read.
    """
    run = results.read(file)
    truth = read_truth(results.folder, run.identity.sequence, run.identity.fingerprint)
    return index_row(results, file, run, truth)


def index_table(rows: Iterable[Mapping[str, Any]]) -> pa.Table:
    """Rows as `index_row` makes them as a table."""
    rows = list(rows)
    columns = {
        field.name: pa.array([row[field.name] for row in rows], field.type) for field in FIELDS
    }
    names = dict.fromkeys(name for row in rows for name in row["scores"])
    columns |= {
        name: pa.array([row["scores"].get(name) for row in rows], pa.float64()) for name in names
    }
    return pa.table(columns)


def index_rows(table: pa.Table) -> Iterator[dict[str, Any]]:
    """Rows of an index one by one: its columns, `path` (relative), and `scores` by name."""
    names = set(FIELDS.names)
    for batch in table.to_batches(max_chunksize=BATCH):
        for row in batch.to_pylist():
            fields = {name: row[name] for name in FIELDS.names}
            path = run_path(row["tracker"], row["sequence"], row["repetition"], row["protocol"])
            scores = {k: v for k, v in row.items() if k not in names and v is not None}
            yield {"path": str(path), **fields, "scores": scores}


def for_json(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row for a script: null for a score that is no finite number, which JSON has not."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {k: v for k, v in row.items() if k not in ("size", "mtime")} | {"scores": scores}
