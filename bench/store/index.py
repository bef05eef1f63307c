"""A row a run: what plans, reports and checks read instead of opening every file.

The index is a cache of the folder. Its rows are matched to the files by size and time of
change; what is new is read and scored, what is gone is dropped. So it may be lost, be old,
or be written by two at once: it is never wrong, only made anew.
"""

import hashlib
import json
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from functools import cache
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from bench import metrics
from bench.record import Run
from bench.scoring import score
from bench.store.arrow_file import arrow_bytes, read_arrow
from bench.store.files import ResultsError, write_atomically
from bench.store.layout import Cell
from bench.store.results import Results
from bench.store.truth import read_truth

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "experiment_folders",
    "for_json",
    "index_row",
    "load_results",
    "ordered_index",
    "read_index",
    "write_index",
]

_FILE = "index.arrow"
_CELL = ("tracker", "sequence", "repetition", "protocol")


def read_index(results: Results) -> list[dict[str, Any]]:
    """One row a finished or failed run, in the order of the files.

    Returns
    -------
    list of dict
        `path` (relative), `digest`, `tracker`, `tracker_name`, `preset`, `parameters`
        (JSON), `sequence`, `fingerprint`, `repetition`, `protocol`, `status`, `failure`,
        `frames`, `date`, `host`, and `scores`: a mapping by the preset `native`.

    Raises
    ------
    ResultsError
        Naming a file that can't be read.
    """
    known = _stored(results)
    rows: list[dict[str, Any]] = []
    changed = False
    for file in results.files():
        row = known.pop(_stamp(results.folder, file), None)
        if row is None:
            row = _row_of_file(results, file)
            changed = True
        rows.append(row)
    if changed or known:
        # A folder that can only be read is read all the same, only not as quickly.
        with suppress(ResultsError):
            write_index(results, rows)
    return rows


def ordered_index(results: Results) -> list[dict[str, Any]]:
    """`read_index` in the order in which the runs were last asked for; others come after."""
    rank = {cell: position for position, cell in enumerate(results.asked().cells)}
    return sorted(read_index(results), key=lambda row: rank.get(_cell(row), len(rank)))


def index_row(results: Results, path: Path, run: Run, truth: Any) -> dict[str, Any]:
    """The index's row of a run that lies in `path`."""
    key = run.identity
    return {
        "stamp": _stamp(results.folder, path),
        "path": str(path.relative_to(results.folder)),
        "digest": key.digest,
        "version": key.version,
        "tracker": key.tracker,
        "tracker_name": key.tracker_name,
        "preset": key.preset,
        "parameters": json.dumps(key.parameters, sort_keys=True),
        "sequence": key.sequence,
        "fingerprint": key.fingerprint,
        "repetition": key.repetition,
        "protocol": key.protocol,
        "status": run.status,
        "failure": run.failure,
        "frames": len(run.boxes),
        "source": run.circumstances.get("source", ""),
        "truth": run.circumstances.get("truth", ""),
        "scores": {} if run.failure else score(run, truth),
    }


def for_json(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row for a script: null for a score that is no finite number, which JSON has not."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {key: value for key, value in row.items() if key != "stamp"} | {"scores": scores}


def write_index(results: Results, rows: Iterable[Mapping[str, Any]]) -> None:
    """Store the rows, in one piece."""
    table = pa.table({"row": [json.dumps(row) for row in rows]}, pa.schema({"row": pa.string()}))
    write_atomically(results.folder / _FILE, arrow_bytes(table))


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


def load_results(folder: str | Path, cells: Collection[Cell] | None = None) -> "pd.DataFrame":
    """All runs of an experiment, or of all experiments in a folder.

    Parameters
    ----------
    folder : str or Path
        `results/<experiment>` or `results`.
    cells : collection of Cell, optional
        Runs that are meant, as (tracker, sequence, repetition, protocol); all by default.

    Returns
    -------
    DataFrame
        One row a run: `experiment`, what `bench.store.index.read_index` gives, and one float
        column a score. Runs that were asked for and are not there have the status
        `missing`; those made with another version of tracker or sequence than was asked for
        last have the status `stale`.

    Raises
    ------
    ResultsError
        Where there are no results, or a file is damaged.
    """
    import pandas as pd  # half a second that only this function's callers pay

    rows = []
    for path in experiment_folders(Path(folder)):
        results = Results(path)
        asked = results.asked().cells
        found = {_cell(row): row for row in ordered_index(results)}
        for cell, row in found.items():
            plain = {key: value for key, value in row.items() if key not in ("scores", "stamp")}
            if asked.get(cell, row["version"]) != row["version"]:
                plain["status"] = "stale"
            rows.append({"experiment": path.name, **plain, **row["scores"]})
        for cell in (cell for cell in asked if cell not in found):
            missing = dict(zip(_CELL, cell, strict=True))
            rows.append({"experiment": path.name, **missing, "status": "missing", "failure": ""})
    if cells is not None:
        chosen = set(cells)
        rows = [row for row in rows if tuple(row[key] for key in _CELL) in chosen]
    columns = ["experiment", *_CELL, "status", "failure"]
    return pd.DataFrame(rows, columns=None if rows else columns)


def _cell(row: Mapping[str, Any]) -> Cell:
    return row["tracker"], row["sequence"], row["repetition"], row["protocol"]


def _stored(results: Results) -> dict[str, dict[str, Any]]:
    """Rows of the index file by stamp; none where it is missing or unreadable."""
    try:
        table = read_arrow(results.folder / _FILE)
        rows = [json.loads(text) for text in table.column("row").to_pylist()]
        return {row["stamp"]: row for row in rows}
    except (OSError, pa.ArrowException, ValueError, KeyError):
        return {}  # it is a cache: it is made anew from the files


def _row_of_file(results: Results, file: Path) -> dict[str, Any]:
    run = results.read(file)
    truth = read_truth(results.folder, run.identity.sequence, run.identity.fingerprint)
    if results.path(run.identity) != file:
        raise ResultsError(
            f"{file} holds the run of another place, {results.path(run.identity)}. Move it there."
        )
    return index_row(results, file, run, truth)


def _stamp(folder: Path, file: Path) -> str:
    """Changes with the file, and with the definition of the scores."""
    status = file.stat()
    return f"{file.relative_to(folder)}|{status.st_size}|{status.st_mtime_ns}|{_scorer_version()}"


@cache
def _scorer_version() -> str:
    files = sorted(Path(str(metrics.__file__)).parent.glob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]
