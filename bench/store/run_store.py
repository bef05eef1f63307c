"""The stored runs of an experiment."""

import json
import logging
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import isfinite
from pathlib import Path
from sqlite3 import Row
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, with_metadata
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.database import DamagedError, Database, open_database
from trackmark.bench.store.keys import FILE_NAME, RUN_KEY_COLUMNS, ResultsError, RunKey, run_key
from trackmark.bench.store.packing import pack, select_group, unpack
from trackmark.bench.store.truth import TruthRow, put_truth

MAX_RUNS = 1_000_000
"""Maximum number of requested runs of an experiment."""

_KEY = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"


class RemovedError(ResultsError):
    """Error for a run that is not stored, for example because another process removed it."""


@dataclass(frozen=True)
class RequestedRuns:
    """Requested runs of an experiment.

    `title` is the title of the report. `versions` holds the requested `Identity.version` by run, in
    the order of the requests. All repetitions of a tracker on a sequence have the same version.
    """

    title: str
    versions: Mapping[RunKey, str]

    def merged_with(self, later: "RequestedRuns") -> "RequestedRuns":
        """Return these and later requests; a later version applies to all repetitions."""
        newest = {(t, s, p): version for (t, s, _, p), version in later.versions.items()}
        versions = {
            (t, s, repetition, p): newest.get((t, s, p), version)
            for (t, s, repetition, p), version in {**self.versions, **later.versions}.items()
        }
        return RequestedRuns(later.title or self.title, versions)


def read_requests(database: Database) -> RequestedRuns:
    """Return the requested runs; empty for a new folder.

    If the list is damaged or lost, a warning is logged, and it is empty.
    """
    errors: list[DamagedError] = []
    rows = database.rows("metadata_of_file", "name = 'requests'", on_damage=errors.append)
    for row in rows:
        title, requests = json.loads(row["value"])
        return RequestedRuns(title, {(t, s, r, p): version for t, s, r, p, version in requests})
    if not errors and database.select("SELECT id FROM run LIMIT 1"):
        errors.append(database.damaged("its list of requested runs is missing"))
    for error in errors:
        warn_of_damage(error)
    return RequestedRuns("", {})


def _write_requests(database: Database, requests: RequestedRuns) -> None:
    rows = [(*key, version) for key, version in requests.versions.items()]
    database.insert("metadata_of_file", [("requests", json.dumps([requests.title, rows]))])


@cache
def _warn(message: str) -> None:
    logging.getLogger("trackmark").warning(message)


def warn_of_damage(error: ResultsError) -> None:
    """Log a warning with the message of an error, once per process; by default on stderr."""
    _warn(str(error))


class RunStore:
    """Store of the runs of one experiment.

    The first write creates the folder `results/<experiment>`, so it need not exist before.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add_requests(self, requests: RequestedRuns) -> None:
        """Create the file if it is missing, and add requested runs.

        Raises `ResultsError` if the file cannot be written, or if there are too many runs. Raises
        `UnicodeEncodeError` for a name that is not UTF-8, before a file is created.
        """
        for key in requests.versions:
            "".join(map(str, key)).encode()
        with open_database(self.folder, for_writing=True) as database:
            present = read_requests(database)
            merged = present.merged_with(requests)
            if len(merged.versions) > MAX_RUNS:
                raise ResultsError(
                    f"{len(merged.versions)} runs are requested in {self.folder}; an experiment "
                    f"has at most {MAX_RUNS}. Use another experiment with --name."
                )
            # Compares the order, too: dictionaries are also equal if their orders differ.
            if merged != present or [*merged.versions] != [*present.versions]:
                _write_requests(database, merged)

    def list_keys(self) -> list[RunKey]:
        """Return the keys of all stored runs (also of damaged ones), in order."""
        with open_database(self.folder) as database:
            rows = database.select("SELECT tracker, sequence, repetition, protocol FROM run")
        try:
            return sorted((run_key(row) for row in rows), key=sort_key)
        except (TypeError, ValueError) as error:
            raise database.damaged(f"a run has a key of another type ({error})") from error

    def add(self, run: Run, replaced_version: str = "") -> bool:
        """Store a run, unless another process has stored a run with the same key in the meantime.

        `replaced_version` is the version of the stored run that may be replaced. It is empty if no
        run was stored when this run was planned. A finished run of the same version is never
        replaced.

        Returns whether the run was stored. Raises `ResultsError` if the file cannot be written.
        """
        return self.add_all([(run, replaced_version)])[0]

    def add_all(
        self, runs: Iterable[tuple[Run, str]], truths: Iterable[TruthRow] = ()
    ) -> list[bool]:
        """Store runs and the ground truth of their sequences in one transaction; see `add`.

        In a transaction of its own, the ground truth could be removed before the runs are stored.
        """
        encoded = [(_encoded_run(run), replaced_version) for run, replaced_version in runs]
        with open_database(self.folder, for_writing=True) as database:
            for truth in truths:
                put_truth(database, truth)
            return [_add(database, run, replaced_version) for run, replaced_version in encoded]

    def remove(self, keys: Collection[RunKey]) -> None:
        """Remove runs together with their scores and requests.

        Ground truths that no other run uses are removed as well. Raises `ResultsError` if the file
        cannot be written.
        """
        with open_database(self.folder, for_writing=True) as database:
            for key in keys:
                database.delete("run", _KEY, *key)
            requests, removed = read_requests(database), set(keys)
            remaining = {k: version for k, version in requests.versions.items() if k not in removed}
            _write_requests(database, replace(requests, versions=remaining))
            database.delete(
                "truth", "(sequence, fingerprint) NOT IN (SELECT sequence, fingerprint FROM run)"
            )

    def read(self, key: RunKey) -> Run:
        """Return a stored run.

        Raises `ResultsError`, which names file and run, if the run is damaged or missing.
        """
        with open_database(self.folder) as database:
            for row in database.rows("run", _KEY, *key):
                return decoded_run(row)
        raise RemovedError(
            f"{self.folder / FILE_NAME} has no run of {key[0]} on {key[1]}, repetition "
            f"{key[2]}, protocol {key[3]!r}. Run the same command again."
        )


def sort_key(key: RunKey) -> tuple[str, str, str, int]:
    """Return the key by which stored runs are sorted."""
    tracker, sequence, repetition, protocol = key
    return tracker, protocol, sequence, repetition


def _encoded_run(run: Run) -> dict[str, Any]:
    """Return the columns of the table `run` in their order, but for the id and the digest."""
    arrays = run_columns(run)
    if run.revised is not None:
        arrays["revised"] = run.revised.T
    for frame, named in run.arrays.items():
        arrays |= {f"requested/{frame}/{name}": array for name, array in named.items()}
    identity = {key: value for key, value in asdict(run.identity).items() if key != "repetition"}
    return {
        **dict(zip(RUN_KEY_COLUMNS, run_key(run.identity), strict=True)),
        "version": run.identity.version,
        "fingerprint": run.identity.fingerprint,
        "status": run.status,
        "failure": _escaped(run.failure),
        "tracker_output": _escaped(run.tracker_output),
        "frames": len(run.boxes),
        "seconds": _seconds(run.metadata.get("seconds")),
        "reading_seconds": _seconds(run.metadata.get("reading_seconds")),
        "identity": json.dumps(identity),  # without the repetition
        "metadata": json.dumps(with_metadata(run).metadata),
        "arrays": pack(arrays),
    }


def _escaped(printed: str) -> str:
    """Escape surrogates, which UTF-8 cannot encode; trackers can print them."""
    return printed.encode("utf-8", "backslashreplace").decode("utf-8")


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
    if run.estimate_frames is not None:
        columns["estimate_frame"] = run.estimate_frames.astype(np.int32)
    columns |= {f"segment/{i}": frames.astype(np.int32) for i, frames in enumerate(run.segments)}
    if run.times is not None:
        times = {name: value for name, value in vars(run.times).items() if value is not None}
        columns |= {f"times/{name}": np.asarray(value) for name, value in times.items()}
    return columns


def _add(database: Database, run: Mapping[str, Any], replaced_version: str) -> bool:
    key, failed = run_key(run), run["status"] == "failed"
    # A damaged run counts as missing and is replaced.
    for existing in database.rows("run", _KEY, *key, on_damage=lambda _: None):
        if existing["version"] == run["version"]:
            # A finished run always replaces a failed one. It is itself replaced only by a timing
            # run that other load disturbed less.
            if existing["status"] != "failed" and (failed or not _is_quieter(run, existing)):
                return False
            if existing["status"] == "failed" and failed and not replaced_version:
                return False
        elif existing["version"] != replaced_version:
            return False
    database.delete("run", _KEY, *key)
    ((run_id,),) = database.select("SELECT coalesce(max(id), 0) + 1 FROM run")
    database.delete("score", "run = ?", run_id)  # of a lost row that had the same id
    database.insert("run", [(run_id, *run.values())])
    return True


def _is_quieter(run: Mapping[str, Any], existing: Row) -> bool:
    """Return whether a timing run has a smaller run delay than the stored one."""
    new, old = (
        json.loads(text).get("run_delay_share", 0.0)
        for text in (run["metadata"], existing["metadata"])
    )
    return bool(run["protocol"] == TIMING and new < old)


def identity_of(row: Row) -> Identity:
    """Return the identity of the run in a row of the table `run`."""
    return Identity(**json.loads(row["identity"]), repetition=row["repetition"])


def decoded_run(row: Row) -> Run:
    """Return the run in a row of the table `run`."""
    columns = unpack(row["arrays"])
    segmentation = select_group(columns, "segmentation")
    measured = select_group(columns, "times")
    times: dict[str, Any] = {k: a if a.shape else float(a) for k, a in measured.items()}
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    for key, array in select_group(columns, "requested").items():
        frame, _, name = key.partition("/")
        arrays.setdefault(int(frame), {})[name] = array
    return Run(
        identity=identity_of(row),
        boxes=columns["boxes"].T,
        visible=columns["visible"],
        confidence=columns["confidence"],
        details=select_group(columns, "detail"),
        failure=row["failure"],
        revised=columns["revised"].T if "revised" in columns else None,
        arrays=arrays,
        segmentation=Segmentation(**segmentation) if segmentation else None,
        times=Times(**times) if times else None,
        states=columns.get("states"),
        estimate_frames=columns.get("estimate_frame"),
        segments=tuple(select_group(columns, "segment").values()),
        metadata=json.loads(row["metadata"]),
        tracker_output=row["tracker_output"],
    )
