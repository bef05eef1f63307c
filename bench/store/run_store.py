"""Writing of the runs of an experiment, and their form in the database."""

import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from sqlite3 import Row
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, with_metadata
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.times import Times
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.database import (
    FILE_NAME,
    RUN_KEY_COLUMNS,
    DamagedError,
    Database,
    ResultsError,
    RunKey,
    open_database,
    pack,
    run_key,
    select_group,
    unpack,
    warn_of_damage,
)
from trackmark.bench.store.run_rows import run_row, scorer_version
from trackmark.bench.store.truth import StoredTruth, put_truth

MAX_RUNS = 1_000_000
"""Maximum number of requested runs of an experiment."""

RUN_KEY = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
"""Condition of a query for the run with a key."""


def read_requests(database: Database) -> tuple[str, dict[RunKey, str]]:
    """Return the title and the requested versions of the runs; empty for a new folder.

    If the list is damaged or lost, a warning is logged, and it is empty.
    """
    messages: list[str] = []
    for row in database.rows("metadata_of_file", "name = 'requests'", on_damage=messages.append):
        title, requests = json.loads(row["value"])
        return title, {(t, s, r, p): version for t, s, r, p, version in requests}
    if not messages and database.select("SELECT id FROM run LIMIT 1"):
        messages.append(str(database.damaged("its list of requested runs is missing")))
    for message in messages:
        warn_of_damage(message)
    return "", {}


def _write_requests(database: Database, title: str, versions: Mapping[RunKey, str]) -> None:
    requests = [(*key, version) for key, version in versions.items()]
    database.insert("metadata_of_file", [("requests", json.dumps([title, requests]))])


class RunStore:
    """Store of the runs of one experiment.

    The first write creates the folder `results/<experiment>`, so it need not exist before.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add_requests(self, requested: Mapping[RunKey, str], title: str = "") -> None:
        """Create the file if it is missing, and add requested runs.

        `requested` contains the `Identity.version` of each run. All repetitions of a tracker on a
        sequence get the latest version. `title` is the title of the report; an empty one keeps the
        former title.

        Raises `ResultsError` if the file cannot be written, or if there are too many runs. Raises
        `UnicodeEncodeError` for a name that is not UTF-8, before a file is created.
        """
        for key in requested:
            "".join(map(str, key)).encode()
        latest = {(t, s, p): version for (t, s, _, p), version in requested.items()}
        with open_database(self.folder, for_writing=True) as database:
            former_title, former = read_requests(database)
            merged = {
                (t, s, repetition, p): latest.get((t, s, p), version)
                for (t, s, repetition, p), version in {**former, **requested}.items()
            }
            if len(merged) > MAX_RUNS:
                raise ResultsError(
                    f"{len(merged)} runs are requested in {self.folder}; an experiment "
                    f"has at most {MAX_RUNS}. Use another experiment with --name."
                )
            if (title and title != former_title) or merged != former:
                _write_requests(database, title or former_title, merged)

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
        return self.add_all([(run, replaced_version)]) != [None]

    def add_all(
        self, runs: Iterable[tuple[Run, str]], truths: Iterable[StoredTruth] = ()
    ) -> list[dict[str, Any] | None]:
        """Store runs and the ground truth of their sequences in one transaction; see `add`.

        In a transaction of its own, the ground truth could be removed before the runs are stored.
        Returns the row of each run, with scores if its ground truth is among `truths`; None for a
        run that was not stored.
        """
        truth_of = {(truth.name, truth.fingerprint): truth for truth in truths}
        encoded = []
        for run, replaced_version in runs:  # encoded and scored before the file is locked
            storable = with_metadata(run)
            truth = truth_of.get((run.identity.sequence, run.identity.fingerprint))
            encoded.append((_columns_of(storable), replaced_version, run_row(storable, truth)))
        with open_database(self.folder, for_writing=True) as database:
            for truth in truth_of.values():
                put_truth(database, truth)
            return [
                row if _add(database, columns, replaced_version, row) else None
                for columns, replaced_version, row in encoded
            ]

    def remove(self, keys: Collection[RunKey]) -> None:
        """Remove runs together with their scores and requests.

        Ground truths that no other run uses are removed as well. Raises `ResultsError` if the file
        cannot be written.
        """
        with open_database(self.folder, for_writing=True) as database:
            for key in keys:
                database.delete("run", RUN_KEY, *key)
            title, requested = read_requests(database)
            for key in keys:
                requested.pop(key, None)
            _write_requests(database, title, requested)
            database.delete(
                "truth", "(sequence, fingerprint) NOT IN (SELECT sequence, fingerprint FROM run)"
            )

    def read(self, key: RunKey) -> Run:
        """Return a stored run.

        Raises `ResultsError`, which names file and run, if the run is damaged or missing.
        """
        with open_database(self.folder) as database:
            for row in database.rows("run", RUN_KEY, *key):
                return decoded_run(row)
        raise DamagedError(
            f"{self.folder / FILE_NAME} has no run of {key[0]} on {key[1]}, repetition "
            f"{key[2]}, protocol {key[3]!r}. Run the same command again."
        )


def sort_key(key: RunKey) -> tuple[str, str, str, int]:
    """Return the key by which stored runs are sorted."""
    tracker, sequence, repetition, protocol = key
    return tracker, protocol, sequence, repetition


def _columns_of(run: Run) -> dict[str, Any]:
    """Return the columns of the table `run` in their order, but for the id and the digest."""
    identity = asdict(run.identity)
    del identity["repetition"]
    return {
        **dict(zip(RUN_KEY_COLUMNS, run_key(run.identity), strict=True)),
        "version": run.identity.version,
        "fingerprint": run.identity.fingerprint,
        "status": run.status,
        "failure": run.failure,
        "tracker_output": run.tracker_output,
        "frames": len(run.boxes),
        "seconds": _seconds(run.metadata.get("seconds")),
        "reading_seconds": _seconds(run.metadata.get("reading_seconds")),
        "identity": json.dumps(identity),
        "metadata": json.dumps(run.metadata),
        "arrays": pack(run_arrays(run)),
    }


def _seconds(value: Any) -> float | None:
    return float(value) if value is not None and isfinite(value) else None


def run_arrays(run: Run) -> dict[str, NDArray[Any]]:
    """Return the arrays of a run, by name."""
    arrays = {"boxes": run.boxes.T, "visible": run.visible, "confidence": run.confidence}
    arrays |= {f"detail/{name}": values for name, values in run.details.items()}
    if run.segmentation is not None:
        arrays |= {f"segmentation/{name}": a for name, a in vars(run.segmentation).items()}
    if run.states is not None:
        arrays["states"] = run.states.astype(np.int32)
    if run.estimate_frames is not None:
        arrays["estimate_frame"] = run.estimate_frames.astype(np.int32)
    arrays |= {f"segment/{i}": frames.astype(np.int32) for i, frames in enumerate(run.segments)}
    if run.times is not None:
        arrays |= {f"times/{name}": np.asarray(a) for name, a in vars(run.times).items()}
    if run.revised is not None:
        arrays["revised"] = run.revised.T
    for frame, named in run.arrays.items():
        arrays |= {f"requested/{frame}/{name}": array for name, array in named.items()}
    return arrays


def _add(
    database: Database, columns: Mapping[str, Any], replaced_version: str, row: Mapping[str, Any]
) -> bool:
    """Store a run and its scores; return False if the stored run with its key is kept."""
    key, failed = run_key(columns), columns["status"] == "failed"
    # A damaged run counts as missing and is replaced.
    for existing in database.rows("run", RUN_KEY, *key, on_damage=lambda _: None):
        if existing["version"] == columns["version"]:
            # A finished run always replaces a failed one. It is itself replaced only by a timing
            # run that other load disturbed less.
            if existing["status"] != "failed" and (failed or not _is_quieter(columns, existing)):
                return False
            if existing["status"] == "failed" and failed and not replaced_version:
                return False
        elif existing["version"] != replaced_version:
            return False
    database.delete("run", RUN_KEY, *key)
    ((run_id,),) = database.select("SELECT coalesce(max(id), 0) + 1 FROM run")
    database.delete("score", "run = ?", run_id)  # of a lost row that had the same id
    database.insert("run", [(run_id, *columns.values())])
    if "scores" in row:
        insert_scores(database, run_id, row)
    return True


def insert_scores(database: Database, run_id: int, row: Mapping[str, Any]) -> None:
    """Store the scores in the row of a run."""
    database.insert("score", [(run_id, scorer_version(), json.dumps(row["scores"]))])


def _is_quieter(columns: Mapping[str, Any], existing: Row) -> bool:
    """Return whether a timing run has a smaller run delay than the stored one."""
    new, old = (
        json.loads(run["metadata"]).get("run_delay_share", 0.0) for run in (columns, existing)
    )
    return bool(columns["protocol"] == TIMING and new < old)


def identity_of(row: Row) -> Identity:
    """Return the identity of the run in a row of the table `run`."""
    return Identity(**json.loads(row["identity"]), repetition=row["repetition"])


def decoded_run(row: Row) -> Run:
    """Return the run in a row of the table `run`."""
    columns = unpack(row["arrays"])
    masks, times = select_group(columns, "segmentation"), select_group(columns, "times")
    segmentation = None
    if masks:
        from trackmark.bench.metrics.regions import Segmentation  # loads OpenCV

        segmentation = Segmentation(**masks)
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
        segmentation=segmentation,
        times=Times(**times) if times else None,
        states=columns.get("states"),
        estimate_frames=columns.get("estimate_frame"),
        segments=tuple(select_group(columns, "segment").values()),
        metadata=json.loads(row["metadata"]),
        tracker_output=row["tracker_output"],
    )
