"""The stored runs of an experiment."""

import json
import platform
import socket
from collections.abc import Collection, Hashable, Iterable
from contextvars import ContextVar
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from math import isfinite
from pathlib import Path
from sqlite3 import Row
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times
from trackmark.bench.store.database import Database, open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE, RunKey, run_key
from trackmark.bench.store.manifest import Manifest, read_manifest, write_manifest
from trackmark.bench.store.packing import pack, unpack
from trackmark.datasets.source_digest import library_versions

MAX_RUNS = 1_000_000
"""Maximum number of requested runs of an experiment."""

_CELL = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
_SECONDS = ("seconds", "frame_seconds", "update_seconds")


class Results:
    """The results of one experiment.

    `folder`: `results/<experiment>`. It need not exist yet.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def prepare(self, manifest: Manifest) -> None:
        """Create the file if it is missing, and add to the requested runs.

        Raises `ResultsError` if the file cannot be written, or there are too many runs, and
        `UnicodeEncodeError` for a name that is not UTF-8, before anything is created.
        """
        for cell in manifest.versions:
            "".join(map(str, cell)).encode()
        with open_database(self.folder, write=True) as database:
            present = read_manifest(database)
            both = present.merged_with(manifest)
            if len(both.versions) > MAX_RUNS:
                raise ResultsError(
                    f"{len(both.versions)} runs are requested in {self.folder}; an experiment has "
                    f"at most {MAX_RUNS}. Use another experiment with --name."
                )
            if both.title != present.title or [*both.versions.items()] != [
                *present.versions.items()
            ]:
                write_manifest(database, both)

    def manifest(self) -> Manifest:
        """Return the runs that were requested so far; none for a new folder.

        Raises `ResultsError` if the file is damaged.
        """
        with open_database(self.folder) as database:
            return read_manifest(database)

    def list_keys(self) -> list[RunKey]:
        """Return the keys of all stored runs, in order. Damaged runs are among them."""
        with open_database(self.folder) as database:
            rows = database.select("SELECT tracker, sequence, repetition, protocol FROM run")
        try:
            return sorted((run_key(row) for row in rows), key=order)
        except (TypeError, ValueError) as error:
            raise database.damaged(f"a run has a key of another type ({error})") from error

    def write(self, run: Run, replaces: str = "") -> bool:
        """Store a run, unless another process has stored a run with the same key meanwhile.

        `run`: finished or failed. `replaces`: version of the stored run that may be replaced; empty
        if none was stored when this run was planned. A finished run of the same version is never
        replaced.

        Returns whether the run was stored. Raises `ResultsError` if it cannot be written.
        """
        return self.write_all([(run, replaces)])[0]

    def write_all(self, runs: Iterable[tuple[Run, str]]) -> list[bool]:
        """Store runs in one transaction; see `write`."""
        prepared = [(_row_of(run), replaces) for run, replaces in runs]
        with open_database(self.folder, write=True) as database:
            return [_write(database, row, replaces) for row, replaces in prepared]

    def remove(self, cells: Collection[RunKey]) -> None:
        """Remove runs, their scores and requests, and all that no other run needs.

        Raises `ResultsError` if the file cannot be written.
        """
        with open_database(self.folder, write=True) as database:
            for cell in cells:
                for row in database.select(f"SELECT id FROM run WHERE {_CELL}", *cell):
                    _delete(database, row["id"])
                database.delete("requested", _CELL, *cell)
            database.delete("tracker", "version NOT IN (SELECT version FROM run)")
            database.delete(
                "truth", "(sequence, fingerprint) NOT IN (SELECT sequence, fingerprint FROM run)"
            )
            database.recount()  # damaged rows may have been removed

    def read(self, cell: RunKey) -> Run:
        """Read a run; within `run_cache` only once.

        Raises `ResultsError` naming the file and the run if it is damaged or missing.
        """
        with open_database(self.folder) as database:
            row = next(iter(database.rows("run", _CELL, *cell)), None)
            if row is None:
                raise ResultsError(
                    f"{self.folder / DATABASE} has no run of {cell[0]} on {cell[1]}, repetition "
                    f"{cell[2]}, by {cell[3]!r}. Run the same command again."
                )
            kept = run_cache.get()
            if kept is not None and (known := kept.get(row["sha256"])):
                return known
            run = _run(database, row)
        return run if kept is None else kept.keep(row["sha256"], run)


class RunCache(dict[Hashable, Run]):
    """Runs in memory, by the digest of their rows."""

    free = 1 << 30
    """Remaining bytes. Runs that do not fit are read whenever they are needed."""

    def keep(self, key: Hashable, run: Run) -> Run:
        """Keep a run if it fits, and return it."""
        arrays = [array for named in run.arrays.values() for array in named.values()]
        arrays += [run.boxes] * 3 + list(run.details.values())  # 3: for all columns of our own
        size = sum(array.nbytes for array in arrays)
        if size <= self.free:
            self.free -= size
            self[key] = run
        return run


run_cache: ContextVar[RunCache | None] = ContextVar("run_cache", default=None)
"""Set by a command that reads each run once."""


def identity_text(identity: Identity) -> str:
    """Return an identity without the repetition, as stored."""
    fields = {key: value for key, value in asdict(identity).items() if key != "repetition"}
    return json.dumps(fields)


def order(cell: RunKey) -> tuple[str, str, str, int]:
    """Return the sort key of stored runs."""
    tracker, sequence, repetition, protocol = cell
    return tracker, protocol, sequence, repetition


def _row_of(run: Run) -> tuple[Identity, tuple[Any, ...], dict[str, bytes]]:
    """Return the identity of a run, its columns after the key, and its contents."""
    key = run.identity
    contents = {"frames": pack(run_columns(run))}
    if run.revised is not None:
        contents["revised"] = pack({"boxes": run.revised.T})
    if run.arrays:
        flat = {f"{at}/{name}": a for at, named in run.arrays.items() for name, a in named.items()}
        contents["arrays"] = pack(flat)
    circumstances = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": socket.gethostname(),
        "platform": platform.platform(),
        "python": platform.python_version(),
        "libraries": _libraries(),
        **run.circumstances,
    }
    row = (
        *(key.version, key.fingerprint, run.status, _text(run.failure), _text(run.output)),
        len(run.boxes),
        *(_seconds(run.circumstances.get(name)) for name in _SECONDS),
        json.dumps(circumstances),
        json.dumps({name: sha256(data).hexdigest() for name, data in contents.items()}),
    )
    return key, row, contents


def _text(text: str) -> str:
    """Escape what UTF-8 cannot hold: bytes of another encoding, which a tracker printed."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _seconds(value: Any) -> float | None:
    return float(value) if value is not None and isfinite(value) else None


def run_columns(run: Run) -> dict[str, NDArray[Any]]:
    """Return the arrays of a run by frame, by name."""
    columns = {"boxes": run.boxes.T, "visible": run.visible, "confidence": run.confidence}
    columns |= {f"detail/{name}": values for name, values in run.details.items()}
    if run.segmentation is not None:
        columns |= {f"segmentation/{name}": a for name, a in vars(run.segmentation).items()}
    if run.states is not None:
        columns["states"] = run.states.astype(np.int32)
    if run.answered is not None:
        columns["answered"] = run.answered.astype(np.int32)
    columns |= {f"segment/{i}": of.astype(np.int32) for i, of in enumerate(run.segments)}
    if run.times is not None:
        times = {name: value for name, value in vars(run.times).items() if value is not None}
        columns |= {f"times/{name}": np.asarray(value) for name, value in times.items()}
    return columns


def _write(
    database: Database, row: tuple[Identity, tuple[Any, ...], dict[str, bytes]], replaces: str
) -> bool:
    key, columns, contents = row
    cell = run_key(key)
    failed = columns[2] == "failed"
    for present in database.rows("run", _CELL, *cell):
        if present["version"] == key.version:
            # A finished run is never repeated, and always replaces a failed one.
            replaceable = present["status"] == "failed" and (replaces != "" or not failed)
        else:
            replaceable = present["version"] == replaces
        if not replaceable:
            return False
        _delete(database, present["id"])
    if not database.rows("tracker", "version = ?", key.version):
        database.insert("tracker", [(key.version, identity_text(key))])
    number = database.select("SELECT coalesce(max(id), 0) + 1 FROM run")[0][0]
    database.insert("run", [(number, *cell, *columns)])
    database.insert("content", [(number, name, data) for name, data in contents.items()])
    return True


def _delete(database: Database, number: int) -> None:
    database.delete("content", "run = ?", number)
    database.delete("score", "run = ?", number)
    database.delete("run", "id = ?", number)


@cache
def _libraries() -> dict[str, str]:
    """Return the versions of the libraries that determine pixels and boxes, by distribution."""
    return library_versions({"av", "cv2", "numba", "numpy", "scipy"})


def _run(database: Database, row: Row) -> Run:
    trackers = database.rows("tracker", "version = ?", row["version"])
    data = {one["name"]: one["data"] for one in database.rows("content", "run = ?", row["id"])}
    digests = {name: sha256(content).hexdigest() for name, content in data.items()}
    if not trackers or digests != json.loads(row["contents"]):
        raise database.damaged(
            f"contents of the run of {row['tracker']} on {row['sequence']}, repetition "
            f"{row['repetition']}, are missing or of another run"
        )
    identity = Identity(**json.loads(trackers[0]["identity"]), repetition=row["repetition"])
    columns = unpack(data["frames"])

    def named(kind: str) -> dict[str, NDArray[Any]]:
        return {k.partition("/")[2]: a for k, a in columns.items() if k.startswith(f"{kind}/")}

    segmentation = named("segmentation")
    times: dict[str, Any] = {k: a if a.shape else float(a) for k, a in named("times").items()}
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    for key, array in unpack(data["arrays"]).items() if "arrays" in data else ():
        frame, _, name = key.partition("/")
        arrays.setdefault(int(frame), {})[name] = array
    return Run(
        identity=identity,
        boxes=columns["boxes"].T,
        visible=columns["visible"],
        confidence=columns["confidence"],
        details=named("detail"),
        failure=row["failure"],
        revised=unpack(data["revised"])["boxes"].T if "revised" in data else None,
        arrays=arrays,
        segmentation=Segmentation(**segmentation) if segmentation else None,
        times=Times(**times) if times else None,
        states=columns.get("states"),
        answered=columns.get("answered"),
        segments=tuple(named("segment").values()),
        circumstances=json.loads(row["circumstances"]),
        output=row["output"],
    )
