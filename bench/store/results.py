"""The stored runs of an experiment."""

import json
import platform
import socket
from collections.abc import Collection, Hashable, Iterable
from contextvars import ContextVar
from dataclasses import asdict, replace
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
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.database import Database, is_intact, open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE, RunKey, run_key
from trackmark.bench.store.manifest import Manifest, read_manifest, write_manifest
from trackmark.bench.store.packing import pack, select_group, unpack
from trackmark.bench.store.truth import TruthRow, put_truth
from trackmark.datasets.source_digest import library_versions

MAX_RUNS = 1_000_000
"""Maximum number of requested runs of an experiment."""

_KEY = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
_SECONDS = ("seconds", "frame_seconds")
_METADATA = -2  # index of `circumstances` in the columns of a run


class RemovedError(ResultsError):
    """Error for a run that is not stored, for example because another process removed it."""


class Results:
    """The results of one experiment.

    `folder` is `results/<experiment>`; it need not exist yet.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def prepare(self, manifest: Manifest) -> None:
        """Create the file if it is missing, and add requested runs.

        Raises `ResultsError` if the file cannot be written, or if there are too many runs. Raises
        `UnicodeEncodeError` for a name that is not UTF-8, before a file is created.
        """
        for key in manifest.versions:
            "".join(map(str, key)).encode()
        with open_database(self.folder, write=True) as database:
            present = read_manifest(database)
            both = present.merged_with(manifest)
            if len(both.versions) > MAX_RUNS:
                raise ResultsError(
                    f"{len(both.versions)} runs are requested in {self.folder}; an experiment has "
                    f"at most {MAX_RUNS}. Use another experiment with --name."
                )
            # Compares the order, too: dictionaries are also equal if their orders differ.
            if both != present or [*both.versions] != [*present.versions]:
                write_manifest(database, both)

    def manifest(self) -> Manifest:
        """Return the requested runs; empty for a new folder.

        Raises `ResultsError` if the file is damaged.
        """
        with open_database(self.folder) as database:
            return read_manifest(database)

    def list_keys(self) -> list[RunKey]:
        """Return the keys of all stored runs (also of damaged ones), in order."""
        with open_database(self.folder) as database:
            rows = database.select("SELECT tracker, sequence, repetition, protocol FROM run")
        try:
            return sorted((run_key(row) for row in rows), key=sort_key)
        except (TypeError, ValueError) as error:
            raise database.damaged(f"a run has a key of another type ({error})") from error

    def write(self, run: Run, replaces: str = "") -> bool:
        """Store a run, unless another process has stored a run with the same key in the meantime.

        `replaces` is the version of the stored run that may be replaced; it is empty if no run was
        stored when this run was planned. A finished run of the same version is never replaced.

        Returns whether the run was stored. Raises `ResultsError` if the file cannot be written.
        """
        return self.write_all([(run, replaces)])[0]

    def write_all(
        self, runs: Iterable[tuple[Run, str]], truths: Iterable[TruthRow] = ()
    ) -> list[bool]:
        """Store runs and the ground truth of their sequences in one transaction; see `write`.

        In a transaction of its own, the ground truth could be removed before the runs are stored.
        """
        prepared = [(_row_of(run), replaces) for run, replaces in runs]
        with open_database(self.folder, write=True) as database:
            for truth in truths:
                put_truth(database, truth)
            return [_write(database, row, replaces) for row, replaces in prepared]

    def remove(self, cells: Collection[RunKey]) -> None:
        """Remove runs with their scores and requests, and trackers and ground truths without runs.

        Raises `ResultsError` if the file cannot be written.
        """
        with open_database(self.folder, write=True) as database:
            for key in cells:
                for row in database.select(f"SELECT id FROM run WHERE {_KEY}", *key):
                    _delete(database, row["id"])
                database.delete("requested", _KEY, *key)
            database.delete("tracker", "version NOT IN (SELECT version FROM run)")
            database.delete(
                "truth", "(sequence, fingerprint) NOT IN (SELECT sequence, fingerprint FROM run)"
            )
            database.recount()  # removed rows can have been damaged

    def read(self, key: RunKey) -> Run:
        """Return a stored run, from `run_cache` if it was read before.

        Raises `ResultsError`, which names file and run, if the run is damaged or missing.
        """
        with open_database(self.folder) as database:
            row = next(iter(database.rows("run", _KEY, *key)), None)
            if row is None:
                raise RemovedError(
                    f"{self.folder / DATABASE} has no run of {key[0]} on {key[1]}, repetition "
                    f"{key[2]}, protocol {key[3]!r}. Run the same command again."
                )
            cache = run_cache.get()
            if cache is not None and (run := cache.get(row["sha256"])):
                return run
            run = _read_run(database, row)
        return run if cache is None else cache.add(row["sha256"], run)


class RunCache(dict[Hashable, Run]):
    """Cache of runs, whose keys are the digests of their rows."""

    free = 1 << 30
    """Free space of the cache [bytes]; runs that do not fit are not cached."""

    def add(self, key: Hashable, run: Run) -> Run:
        """Add a run if it fits; return the run."""
        arrays = [array for named in run.arrays.values() for array in named.values()]
        arrays += [run.boxes] * 3 + list(run.details.values())  # 3: estimate for the other columns
        size = sum(array.nbytes for array in arrays)
        if size <= self.free:
            self.free -= size
            self[key] = run
        return run


run_cache: ContextVar[RunCache | None] = ContextVar("run_cache", default=None)
"""Cache for a command that reads runs several times; None by default."""


def sort_key(key: RunKey) -> tuple[str, str, str, int]:
    """Return the key by which stored runs are sorted."""
    tracker, sequence, repetition, protocol = key
    return tracker, protocol, sequence, repetition


def _row_of(run: Run) -> tuple[Identity, tuple[Any, ...], dict[str, bytes]]:
    """Return the identity of a run, the columns after its key, and its packed arrays by kind."""
    key = run.identity
    contents = {"frames": pack(run_columns(run))}
    if run.revised is not None:
        contents["revised"] = pack({"boxes": run.revised.T})
    if run.arrays:
        flat = {f"{frame}/{k}": a for frame, named in run.arrays.items() for k, a in named.items()}
        contents["arrays"] = pack(flat)
    circumstances = with_circumstances(run).circumstances
    row = (
        *(key.version, key.fingerprint, run.status, _text(run.failure), _text(run.output)),
        len(run.boxes),
        *(_seconds(run.circumstances.get(name)) for name in _SECONDS),
        json.dumps(circumstances),
        json.dumps({name: sha256(data).hexdigest() for name, data in contents.items()}),
    )
    return key, row, contents


def with_circumstances(run: Run) -> Run:
    """Return the run with date, machine and libraries, unless it has them already."""
    circumstances = {
        "date": datetime.now(UTC).isoformat(timespec="microseconds"),
        "host": socket.gethostname(),
        "platform": platform.platform(),
        "python": platform.python_version(),
        "libraries": _libraries(),
        **run.circumstances,
    }
    return replace(run, circumstances=circumstances)


def _text(text: str) -> str:
    """Escape surrogates, which UTF-8 cannot encode; trackers can print them."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _seconds(value: Any) -> float | None:
    return float(value) if value is not None and isfinite(value) else None


def run_columns(run: Run) -> dict[str, NDArray[Any]]:
    """Return the per-frame arrays of a run, by name."""
    columns = {"boxes": run.boxes.T, "visible": run.visible, "confidence": run.confidence}
    columns |= {f"detail/{name}": values for name, values in run.details.items()}
    if run.segmentation is not None:
        columns |= {f"segmentation/{name}": a for name, a in vars(run.segmentation).items()}
    if run.states is not None:
        columns["states"] = run.states.astype(np.int32)
    if run.source_frames is not None:
        columns["answered"] = run.source_frames.astype(np.int32)
    columns |= {f"segment/{i}": frames.astype(np.int32) for i, frames in enumerate(run.segments)}
    if run.times is not None:
        times = {name: value for name, value in vars(run.times).items() if value is not None}
        columns |= {f"times/{name}": np.asarray(value) for name, value in times.items()}
    return columns


def _write(
    database: Database, row: tuple[Identity, tuple[Any, ...], dict[str, bytes]], replaces: str
) -> bool:
    identity, columns, contents = row
    key = run_key(identity)
    failed = columns[2] == "failed"
    fields = {name: value for name, value in asdict(identity).items() if name != "repetition"}
    tracker = identity.version, json.dumps(fields)
    stored_trackers = database.select("SELECT * FROM tracker WHERE version = ?", identity.version)
    if not stored_trackers:
        database.insert("tracker", [tracker])
    elif not is_intact(stored_trackers[0]):
        database.repair("tracker", tracker)
    for present in database.select(f"SELECT * FROM run WHERE {_KEY}", *key):
        intact = is_intact(present)  # a damaged run counts as missing and is replaced
        if intact and present["version"] == identity.version:
            # A finished run always replaces a failed one. It is itself replaced only by a timing
            # run that other load disturbed less.
            if present["status"] != "failed" and (failed or not _is_quieter(key, columns, present)):
                return False
            if present["status"] == "failed" and failed and not replaces:
                return False
        elif intact and present["version"] != replaces:
            return False
        _delete(database, present["id"])
        if not intact:  # the deleted digest may have been wrong, and with it the tables' digests
            database.recount("run", "content", "score")
    run_id = database.select("SELECT coalesce(max(id), 0) + 1 FROM run")[0][0]
    database.insert("run", [(run_id, *key, *columns)])
    database.insert("content", [(run_id, name, data) for name, data in contents.items()])
    return True


def _is_quieter(key: RunKey, columns: tuple[Any, ...], present: Row) -> bool:
    """Return whether a timing run has a smaller run delay than the stored one."""
    new, stored = (
        json.loads(text).get("run_delay_share", 0.0)
        for text in (columns[_METADATA], present["circumstances"])
    )
    return key[3] == TIMING and new < stored


def _delete(database: Database, run_id: int) -> None:
    database.delete("content", "run = ?", run_id)
    database.delete("score", "run = ?", run_id)
    database.delete("run", "id = ?", run_id)


@cache
def _libraries() -> dict[str, str]:
    """Return the versions of the libraries that can influence pixels and boxes, by their name."""
    return library_versions({"av", "cv2", "numba", "numpy", "scipy"})


def _read_run(database: Database, row: Row) -> Run:
    trackers = database.rows("tracker", "version = ?", row["version"])
    data = {part["name"]: part["data"] for part in database.rows("content", "run = ?", row["id"])}
    digests = {name: sha256(content).hexdigest() for name, content in data.items()}
    if not trackers or digests != json.loads(row["contents"]):
        raise database.damaged(
            f"the contents of the run of {row['tracker']} on {row['sequence']}, repetition "
            f"{row['repetition']}, are missing or belong to another run"
        )
    identity = Identity(**json.loads(trackers[0]["identity"]), repetition=row["repetition"])
    columns = unpack(data["frames"])
    segmentation = select_group(columns, "segmentation")
    measured = select_group(columns, "times")
    times: dict[str, Any] = {k: a if a.shape else float(a) for k, a in measured.items()}
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    for key, array in unpack(data["arrays"]).items() if "arrays" in data else ():
        frame, _, name = key.partition("/")
        arrays.setdefault(int(frame), {})[name] = array
    return Run(
        identity=identity,
        boxes=columns["boxes"].T,
        visible=columns["visible"],
        confidence=columns["confidence"],
        details=select_group(columns, "detail"),
        failure=row["failure"],
        revised=unpack(data["revised"])["boxes"].T if "revised" in data else None,
        arrays=arrays,
        segmentation=Segmentation(**segmentation) if segmentation else None,
        times=Times(**times) if times else None,
        states=columns.get("states"),
        source_frames=columns.get("answered"),
        segments=tuple(select_group(columns, "segment").values()),
        circumstances=json.loads(row["circumstances"]),
        output=row["output"],
    )
