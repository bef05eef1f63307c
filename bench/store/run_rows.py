"""Rows of stored runs with scores, which are computed once per run and version of the scorer."""

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache
from math import isfinite
from pathlib import Path
from sqlite3 import Row
from typing import Any

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_score, score_both
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.times import TIME_FIELDS
from trackmark.bench.store.database import DamagedError, open_database
from trackmark.bench.store.keys import ResultsError, RunKey, run_key
from trackmark.bench.store.run_store import (
    RemovedError,
    RequestedRuns,
    RunStore,
    decoded_run,
    identity_of,
    read_requests,
    sort_key,
    warn_of_damage,
)
from trackmark.bench.store.truth import MissingTruthError, StoredTruth, read_truth, unpack_truth
from trackmark.datasets.source_digest import tree_digest

TEXT_FIELDS = (
    *("tracker", "tracker_name", "preset", "parameters", "version", "tracker_version"),
    *("sequence", "fingerprint", "protocol", "status", "failure", "source", "truth"),
    *("date", "generators", "clock", "machine", "time_note"),
)
"""Names of the text fields of a row."""

_METADATA_TEXTS = ("source", "truth", "date", "clock", "machine", "time_note")

NUMBER_FIELDS = ("repetition", "frames", "seconds", "reading_seconds", *TIME_FIELDS)
"""Names of the number fields of a row."""

MAX_KEPT = 1 << 30
"""Maximum size of the packed arrays of runs that stay in memory after they were read [bytes]."""

_BATCH = 1000  # runs whose scores are stored in one transaction


class StoredRuns:
    """Content of a results folder, read in one transaction.

    The whole content is read in any case, because digests are compared. Runs therefore stay in
    memory, packed, and are unpacked when they are used. Those that exceed `MAX_KEPT` are read again
    then.

    Attributes
    ----------
    folder : Path or None
        Results folder; None for runs in memory.
    rows : list of dict
        One row, without scores, per finished or failed run, in order. The keys are `TEXT_FIELDS`
        and `NUMBER_FIELDS`. `parameters` is JSON. `version` depends on tracker, parameters and
        sequence; `tracker_version` depends on the tracker's code and libraries. `source` and
        `truth` are the paths from which the sequence was opened. `seconds` is the wall time of all
        calls of the tracker, and `reading_seconds` the mean time to decode or render an image
        [s].
        `bench.metrics.times.time_fields` describes the times per frame and `time_note`. `clock` is
        the clock of these times, and `machine` the machine on which they were measured. `date` is
        the date and time (UTC, ISO 8601) at which the run was stored first. `generators` are the
        global random generators from which the tracker has drawn. Damaged runs, and runs whose
        ground truth is damaged or missing, are left out, with a warning on standard error.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.rows: list[dict[str, Any]] = []
        self.requests = RequestedRuns("", {})
        self.runs: dict[RunKey, Run | Row] = {}
        self.truths: dict[tuple[str, str], StoredTruth | Row] = {}
        self.scores: dict[RunKey, dict[str, float]] = {}

    @classmethod
    def read(cls, folder: Path, *, keeps_runs: bool = True) -> "StoredRuns":
        """Read a results folder, or only its rows; raise `ResultsError` if the file is damaged."""
        stored_runs, room = cls(folder), MAX_KEPT if keeps_runs else 0
        shared: dict[str, dict[str, Any]] = {}
        with open_database(folder) as database:
            stored_runs.requests = read_requests(database)
            named = {
                tuple(row) for row in database.select("SELECT sequence, fingerprint FROM truth")
            }
            rows = database.rows("truth", on_damage=warn_of_damage)
            stored_runs.truths = {(row["sequence"], row["fingerprint"]): row for row in rows}
            # Damaged scores are computed again.
            scored = database.rows("score", "scorer = ?", _scorer_version(), on_damage=_ignore)
            scores = {row["run"]: row["scores"] for row in scored}
            for row in database.rows("run", on_damage=warn_of_damage):
                truth = row["sequence"], row["fingerprint"]
                if truth not in stored_runs.truths:
                    if truth not in named:
                        warn_of_damage(MissingTruthError(database.path, *truth))
                    continue
                version, key = row["version"], run_key(row)
                if version not in shared:
                    shared[version] = _identity_fields(identity_of(row))
                ended = row["status"], row["failure"], row["repetition"], row["frames"]
                fields = _fields(json.loads(row["metadata"]), *ended)
                stored_runs.rows.append(shared[version] | fields)
                if row["id"] in scores:
                    stored_runs.scores[key] = json.loads(scores[row["id"]])
                room -= len(row["arrays"])
                if room >= 0:
                    stored_runs.runs[key] = row
        stored_runs.rows.sort(key=lambda row: sort_key(run_key(row)))
        return stored_runs

    def run(self, key: RunKey) -> Run:
        """Return a run by its whole key.

        Raises `ResultsError`, which names the file, if a run that must be read again is damaged or
        was removed.
        """
        run = self.runs.get(key)
        if run is None:
            if self.folder is None:
                raise KeyError(key)
            return RunStore(self.folder).read(key)
        return run if isinstance(run, Run) else decoded_run(run)

    def truth(self, sequence: str, fingerprint: str) -> StoredTruth:
        """Return a ground truth; raise `ResultsError` if it is missing or damaged."""
        key = sequence, fingerprint
        truth = self.truths.get(key)
        if truth is None:
            if self.folder is None:
                raise KeyError(key)
            truth = read_truth(self.folder, *key)
        elif isinstance(truth, Row):
            truth = unpack_truth(truth)
        self.truths[key] = truth
        return truth

    def scored_rows(self, progress: Callable[[int, int], None]) -> list[dict[str, Any]]:
        """Return the rows, each with a dict `scores`; store scores that were not stored.

        `progress` is called with the number of runs scored so far, and the number of runs to score.
        For the scores, see `bench.evaluation.score_both`.
        """
        unscored = [row for row in self.rows if run_key(row) not in self.scores]
        removed = set()
        for begin in range(0, len(unscored), _BATCH):
            scored = []
            for done, row in enumerate(unscored[begin : begin + _BATCH], begin + 1):
                key = run_key(row)
                try:
                    run = self.run(key)
                except (DamagedError, RemovedError) as error:  # after the rows were read
                    warn_of_damage(error)
                    removed.add(key)
                    continue
                self.scores[key] = _scores(run, self.truth(row["sequence"], row["fingerprint"]))
                scored.append({**row, "scores": self.scores[key]})
                progress(done, len(unscored))
            if self.folder is not None:
                # In a read-only folder, every reader computes the scores.
                with suppress(ResultsError):
                    store_scores(self.folder, scored)
        keyed = ((run_key(row), row) for row in self.rows)
        return [{**row, "scores": self.scores[key]} for key, row in keyed if key not in removed]


def list_runs(store: RunStore) -> list[dict[str, Any]]:
    """Return the rows of a results folder, without scores; see `StoredRuns.rows`."""
    return StoredRuns.read(store.folder, keeps_runs=False).rows


def run_row(run: Run, truth: Any) -> dict[str, Any]:
    """Return the row of a run, with scores."""
    ended = run.status, run.failure, run.identity.repetition, len(run.boxes)
    fields = _fields(run.metadata, *ended)
    return {**_identity_fields(run.identity), **fields, "scores": _scores(run, truth)}


def store_scores(folder: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Store the scores of rows, unless their runs were replaced or removed in the meantime.

    Raises `ResultsError` if they cannot be written.
    """
    key = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
    query = f"SELECT id FROM run WHERE {key} AND version = ? AND status = ?"
    with open_database(folder, for_writing=True) as database:
        for row in rows:
            values = (*run_key(row), row["version"], row["status"])
            for (run_id,) in database.select(query, *values):
                scores = run_id, _scorer_version(), json.dumps(row["scores"])
                database.insert("score", [scores])


def json_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row in which None (null in JSON) replaces scores that are not finite."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {**row, "scores": scores}


def _ignore(error: DamagedError) -> None:
    pass


def _fields(
    metadata: Mapping[str, Any], status: str, failure: str, repetition: int, n_frames: int
) -> dict[str, Any]:
    return {
        "status": status,
        "failure": failure,
        "generators": ", ".join(metadata.get("generators", ())),
        **{name: metadata.get(name, "") for name in _METADATA_TEXTS},
        "repetition": repetition,
        "frames": n_frames,
        **{name: metadata.get(name) for name in NUMBER_FIELDS[2:]},
    }


def _identity_fields(identity: Identity) -> dict[str, Any]:
    return {
        "tracker": identity.tracker,
        "tracker_name": identity.tracker_name,
        "preset": identity.preset,
        "parameters": json.dumps(identity.parameters, sort_keys=True),
        "version": identity.version,
        "tracker_version": identity.tracker_version,
        "sequence": identity.sequence,
        "fingerprint": identity.fingerprint,
        "protocol": identity.protocol,
    }


def _scores(run: Run, truth: Any) -> dict[str, float]:
    """Return the scores by the metrics `native`; empty if it cannot score the run."""
    if run.failure or run.states is not None or not can_score("native", run.identity.protocol):
        return {}
    return score_both(run, truth)


@cache
def _scorer_version() -> str:
    return scorer_digest(Path(__file__).parents[1])


def scorer_digest(bench: Path) -> str:
    """Return a digest of the code that computes the stored scores: this file and its imports.

    `bench` is the folder of the package. Metrics and protocols are found by their names, so
    that no import statement names them.
    """
    by_name = [
        file for part in ("metrics/sets", "protocols") for file in bench.glob(f"{part}/*.py")
    ]
    return tree_digest(bench / "store" / Path(__file__).name, bench, by_name)
