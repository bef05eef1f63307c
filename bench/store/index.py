"""A row a run: what plans, reports and checks read instead of opening every file.

The index is a cache of the folder. Its rows are matched to the files by name, size and time of
change; what is new is read and scored, what is gone is dropped. So it may be lost, be old,
be damaged, or be written by two at once: it is never wrong, only made anew.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.evaluation.scoring import score_both
from bench.store.arrow_file import arrow_bytes, read_arrow
from bench.store.columns import CELL, PLACE, TEXT, numbered, places, tidy, with_place
from bench.store.files import ResultsError, write_atomically
from bench.store.layout import run_path
from bench.store.listing import list_runs
from bench.store.results import Results
from bench.store.truth import read_truth

__all__ = [
    "BATCH",
    "experiment_folders",
    "for_json",
    "index_row",
    "index_rows",
    "index_table",
    "read_index",
    "read_table",
    "row_of_file",
    "with_rows",
    "write_index",
]

_FILE = "index.arrow"
_SCORER_KEY = b"trackmark.scorer"
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
_FIELDS = pa.schema(
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


def read_table(
    results: Results, progress: Callable[[int, int], None] = lambda *_: None
) -> pa.Table:
    """One row a finished or failed run, in the order of the files.

    Parameters
    ----------
    results : Results
        Of an experiment.
    progress : callable, optional
        Called with the numbers of files that were opened, and of all that must be.

    Returns
    -------
    Table
        `tracker`, `tracker_name`, `preset`, `parameters` (JSON), `version`, `sequence`,
        `fingerprint`, `protocol`, `status`, `failure`, `source` and `truth` (where the
        sequence was opened from), `repetition`, `frames`, `size` [bytes] and `mtime`
        [nanoseconds] of the file, `seconds` that the tracker took, `frame_seconds` that a
        frame took to decode or render, and a column a score of
        `bench.evaluation.scoring.score_both` (null where a run has it not, NaN where it is
        undefined).

    Raises
    ------
    ResultsError
        Naming a file that can't be read.
    """
    listed = list_runs(results.folder)
    stored = _stored(results)
    rows = _unchanged(listed, stored)
    if np.array_equal(rows, np.arange(len(stored))):
        return stored
    kept, new = np.flatnonzero(rows >= 0), np.flatnonzero(rows < 0)
    files = (_file(results.folder, listed, int(row)) for row in new)
    made = [index_table(batch) for batch in _batches(results, files, len(new), progress)]
    table = _together([stored.take(pa.array(rows[kept])), *made])
    table = tidy(table.take(pa.array(np.argsort(np.concatenate([kept, new])))))
    # A folder that can only be read is read all the same, only not as quickly.
    with suppress(ResultsError):
        write_index(results, table)
    return table


def read_index(results: Results) -> list[dict[str, Any]]:
    """The rows of `read_table` as `index_rows` gives them: for a few thousand runs.

    Raises
    ------
    ResultsError
        Naming a file that can't be read.
    """
    return list(index_rows(read_table(results)))


def experiment_folders(folder: Path) -> list[Path]:
    """Experiments in a folder: itself, or those right below it.

    Raises
    ------
    ResultsError
        Where there are none.
    """
    candidates = [folder, *sorted(folder.glob("*/"))] if folder.is_dir() else []
    found = [path for path in candidates if (path / "plan.json").is_file()]
    if not found:
        raise ResultsError(f"{folder}: there are no results here. `trackmark run` makes some.")
    return found


def index_rows(table: pa.Table) -> Iterator[dict[str, Any]]:
    """Rows of an index one by one: its columns, `path` (relative), and `scores` by name."""
    names = set(_FIELDS.names)
    for batch in table.to_batches(max_chunksize=BATCH):
        for row in batch.to_pylist():
            fields = {name: row[name] for name in _FIELDS.names}
            path = run_path(row["tracker"], row["sequence"], row["repetition"], row["protocol"])
            scores = {k: v for k, v in row.items() if k not in names and v is not None}
            yield {"path": str(path), **fields, "scores": scores}


def index_table(rows: Iterable[Mapping[str, Any]]) -> pa.Table:
    """Rows as `index_row` makes them as a table."""
    rows = list(rows)
    columns = {
        field.name: pa.array([row[field.name] for row in rows], field.type) for field in _FIELDS
    }
    names = dict.fromkeys(name for row in rows for name in row["scores"])
    columns |= {
        name: pa.array([row["scores"].get(name) for row in rows], pa.float64()) for name in names
    }
    return pa.table(columns)


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


def for_json(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row for a script: null for a score that is no finite number, which JSON has not."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {k: v for k, v in row.items() if k not in ("size", "mtime")} | {"scores": scores}


def with_rows(table: pa.Table, further: list[pa.Table]) -> pa.Table:
    """The index with further rows; of a run that has several the last one stays."""
    both = _together([table, *further])
    cells = numbered([both], CELL)[0]
    _, last = np.unique(cells[::-1], return_index=True)
    return both if len(last) == len(both) else both.take(pa.array(np.sort(len(both) - 1 - last)))


def write_index(results: Results, table: pa.Table) -> None:
    """Store the rows, in one piece.

    Raises
    ------
    ResultsError
        Where they can't be written.
    """
    content = arrow_bytes(table, {_SCORER_KEY: _scorer_version()})
    write_atomically(results.folder / _FILE, content)


def _stored(results: Results) -> pa.Table:
    """Rows of the index file; none where it is missing, unreadable, or of other scores."""
    with suppress(OSError, ResultsError, pa.ArrowException):  # it is a cache: made anew
        table = read_arrow(results.folder / _FILE)
        metadata = table.schema.metadata
        fields = {field.name: field.type for field in table.schema}
        known = all(fields.get(field.name) == field.type for field in _FIELDS)
        if known and metadata.get(_SCORER_KEY) == _scorer_version():
            return _together([table.replace_schema_metadata(None)])
    return _FIELDS.empty_table()


def _together(tables: list[pa.Table]) -> pa.Table:
    whole = pa.concat_tables(tables, promote_options="default")
    return whole.unify_dictionaries().combine_chunks()


def _unchanged(listed: pa.Table, stored: pa.Table) -> NDArray[np.int64]:
    """Row of the index for every file that is as it was; -1 for the others."""
    found = places(*numbered([listed, with_place(stored)], PLACE))
    if len(stored):
        for column in ("size", "mtime"):
            differs = listed[column].to_numpy() != stored[column].to_numpy()[found]
            found[differs] = -1
    return found


def _file(folder: Path, listed: pa.Table, row: int) -> Path:
    tracker, sequence, repetition = (listed[name][row].as_py() for name in PLACE)
    return Path(folder, tracker, sequence, f"{repetition}.parquet")


def _batches(
    results: Results, files: Iterable[Path], total: int, progress: Callable[[int, int], None]
) -> Iterator[list[dict[str, Any]]]:
    """Rows of files, some thousand at a time: as objects they are large."""
    rows: list[dict[str, Any]] = []
    for number, file in enumerate(files, 1):
        rows.append(row_of_file(results, file))
        progress(number, total)
        if len(rows) == BATCH or number == total:
            yield rows
            rows = []


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


@cache
def _scorer_version() -> bytes:
    """Changes with the definition of the scores."""
    bench = Path(__file__).parents[1]
    files = [*sorted(bench.glob("metrics/*.py")), bench / "evaluation/scoring.py"]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest().encode()
