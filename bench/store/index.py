"""A row a run: what plans, reports and checks read instead of opening every file.

The index is a cache of the folder. Its rows are matched to the files by name, size and time of
change; what is new is read and scored, what is gone is dropped. So it may be lost, be old,
be damaged, or be written by two at once: it is never wrong, only made anew.
"""

import hashlib
import json
import os
import re
import time
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_judge, score_both
from trackmark.bench.store.checksum import arrow_bytes, read_arrow
from trackmark.bench.store.columns import (
    CELL,
    PLACE,
    TEXT,
    coded,
    numbered,
    places,
    tidy,
    with_place,
)
from trackmark.bench.store.files import ResultsError, unreadable, write_atomically
from trackmark.bench.store.layout import run_path
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth

_TEXTS = (
    "tracker",
    "tracker_name",
    "preset",
    "parameters",
    "version",
    "tracker_version",
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
        ("update_seconds", pa.float64()),
    ]
)
BATCH = 4096
"""Rows that are held as Python objects at a time."""
SCORED_BY = ("centre_error", "native", "overlap", "regions", "times")
"""Modules of `bench.metrics` that define what an index holds; other presets change no index."""


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
        "tracker_version": key.tracker_digest,
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
        "update_seconds": run.circumstances.get("update_seconds"),
        "scores": score_both(run, truth) if _has_scores(run) else {},
    }


def _has_scores(run: Run) -> bool:
    """Whether `native` judges it: not where the tracker was begun again after failures."""
    return not run.failure and run.states is None and can_judge("native", run.identity.protocol)


def row_of_file(results: Results, file: Path) -> dict[str, Any]:
    """The index's row of a run as it lies on disk, scored by the truth that it was made with.

    Raises `ResultsError` naming a file that can't be read.
    """
    run = results.read(file)
    truth = read_truth(results.folder, run.identity.sequence, run.identity.fingerprint)
    try:
        return index_row(results, file, run, truth)
    except ValueError as error:  # sealed by somebody: a run of ours has the truth's frames
        raise ResultsError(
            f"{file} is damaged ({error}). Remove it and run the same command again."
        ) from error


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


_FILE = "index.arrow"
_SCORER_KEY = b"trackmark.scorer"
_RUN = re.compile(r"(0|[1-9]\d*)\.parquet")
_LEAST_SECONDS = 5.0  # between two times that a growing index is written
_PATIENCE = 50.0  # and so many times what writing takes


def read_table(
    results: Results, progress: Callable[[int, int], None] = lambda *_: None
) -> pa.Table:
    """One row a finished or failed run, in the order of the files.

    `results`: of an experiment. `progress`: called with the numbers of files that were opened, and
    of all that must be.

    Columns: `tracker`, `tracker_name`, `preset`, `parameters` (JSON), `version` (of tracker,
    parameters and sequence together), `tracker_version` (of the tracker's code and libraries alone,
    the same on every sequence), `sequence`, `fingerprint`, `protocol`, `status`, `failure`,
    `source` and `truth` (where the sequence was opened from), `repetition`, `frames`, `size`
    [bytes] and `mtime` [nanoseconds] of the file, `seconds` that the tracker took, `frame_seconds`
    that a frame took to decode or render, `update_seconds` of CPU that an update took (median; null
    in runs of before it was kept), and a column a score of
    `bench.evaluation.scoring.score_both` (null where a run has it not, NaN where it is undefined).

    Raises `ResultsError` naming a file that can't be read.
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
        _write_index(results, table)
    return table


def read_index(results: Results) -> list[dict[str, Any]]:
    """The rows of `read_table` as `index_rows` gives them: for a few thousand runs.

    Raises `ResultsError` naming a file that can't be read.
    """
    return list(index_rows(read_table(results)))


class GrowingIndex:
    """An index that is written now and then; that takes about a fiftieth of the time at most.

    What is not written yet when a command is killed is found by the next reader, on disk.
    """

    def __init__(self, results: Results) -> None:
        self._results = results
        self._table = read_table(results)
        self._tables: list[pa.Table] = []
        self._rows: list[dict[str, Any]] = []
        self._due = time.monotonic() + _LEAST_SECONDS

    def add(self, rows: list[dict[str, Any]]) -> None:
        """Add rows as `index_row` makes them; their runs lie on disk."""
        self._rows += rows
        if len(self._rows) >= BATCH:
            self._pack()
        if time.monotonic() > self._due:
            self.write()

    def write(self) -> None:
        """Write it, if it has grown.

        Raises `ResultsError` where it can't be written.
        """
        self._pack()
        if not self._tables:
            return
        began = time.monotonic()
        self._table = _with_rows(self._table, self._tables)
        self._tables = []
        _write_index(self._results, self._table)
        now = time.monotonic()
        self._due = now + max(_LEAST_SECONDS, _PATIENCE * (now - began))

    def _pack(self) -> None:
        """As objects rows are large."""
        if self._rows:
            self._tables.append(index_table(self._rows))
            self._rows = []


def list_runs(folder: Path) -> pa.Table:
    """Runs in an experiment's folder, in order.

    Columns: `tracker_folder`, `sequence_folder`, `repetition`, `size` [bytes] and `mtime`
    [nanoseconds], a row a run.

    Raises `ResultsError` for a Parquet file that is called like no run.
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
        raise unreadable(folder, error) from error


def _with_rows(table: pa.Table, further: list[pa.Table]) -> pa.Table:
    """The index with further rows; of a run that has several the last one stays."""
    both = _together([table, *further])
    cells = numbered([both], CELL)[0]
    _, last = np.unique(cells[::-1], return_index=True)
    return both if len(last) == len(both) else both.take(pa.array(np.sort(len(both) - 1 - last)))


def _write_index(results: Results, table: pa.Table) -> None:
    """Store the rows, in one piece.

    Raises `ResultsError` where they can't be written.
    """
    content = arrow_bytes(table, {_SCORER_KEY: _scorer_version()})
    write_atomically(results.folder / _FILE, content)


def _stored(results: Results) -> pa.Table:
    """Rows of the index file; none where it is missing, unreadable, or of other scores."""
    with suppress(OSError, ResultsError, pa.ArrowException):  # it is a cache: made anew
        table = read_arrow(results.folder / _FILE)
        metadata = table.schema.metadata
        fields = {field.name: field.type for field in table.schema}
        known = all(fields.get(field.name) == field.type for field in FIELDS)
        if known and metadata.get(_SCORER_KEY) == _scorer_version():
            return _together([table.replace_schema_metadata(None)])
    return FIELDS.empty_table()


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


@cache
def _scorer_version() -> bytes:
    """Changes with the definition of the scores."""
    bench = Path(__file__).parents[1]
    files = [bench / "metrics" / f"{name}.py" for name in SCORED_BY]
    files.append(bench / "evaluation/scoring.py")
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest().encode()
