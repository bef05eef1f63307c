"""Rows of stored runs with scores, which are computed once per run and version of the scorer."""

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_score, score_both
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.times import TIME_FIELDS
from trackmark.bench.store.database import DamagedError, Database, open_database
from trackmark.bench.store.keys import ResultsError, run_key
from trackmark.bench.store.run_store import (
    RequestedRuns,
    RunStore,
    identity_of,
    read_requests,
    sort_key,
    warn_of_damage,
)
from trackmark.bench.store.truth import MissingTruthError
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

BATCH = 200
"""Number of runs that are read in one transaction, which limits the memory."""


def list_runs(results: RunStore) -> list[dict[str, Any]]:
    """Return one row, without scores, per finished or failed run, in order.

    The keys are `TEXT_FIELDS` and `NUMBER_FIELDS`. `parameters` is JSON. `version` depends on
    tracker, parameters and sequence; `tracker_version` depends on the tracker's code and libraries.
    `source` and `truth` are the paths from which the sequence was opened. `seconds` is the wall
    time of all calls of the tracker, and `reading_seconds` the mean time to decode or render an
    image [s]. `bench.metrics.times.time_fields` describes the times per frame and `time_note`.
    `clock` is the clock of these times, and `machine` the machine on which they were measured.
    `date` is the date and time (UTC, ISO 8601) at which the run was stored first. `generators` are
    the global random generators from which the tracker has drawn.

    Damaged runs, and runs whose ground truth is damaged or missing, are left out, with a warning on
    standard error.
    """
    with open_database(results.folder) as database:
        return [row for _, row in _read_rows(database)]


def scored_rows(
    results: RunStore, progress: Callable[[int, int], None] = lambda *_: None
) -> list[dict[str, Any]]:
    """Return the rows of `list_runs`, each with a dict `scores`; see `bench.evaluation.score_both`.

    `progress` is called with the number of runs scored so far, and the number of runs to score.

    Damaged runs and other damage are handled as in `list_runs`.
    """
    return scored_rows_and_requests(results, progress)[0]


def scored_rows_and_requests(
    results: RunStore, progress: Callable[[int, int], None]
) -> tuple[list[dict[str, Any]], RequestedRuns]:
    """Return the rows of `scored_rows` and the requested runs, from one transaction."""
    with open_database(results.folder) as database:
        rows, requests = dict(_read_rows(database)), read_requests(database)
        # Damaged scores are computed again.
        for score in database.rows("score", "scorer = ?", _scorer_version(), on_damage=_ignore):
            if score["run"] in rows:
                rows[score["run"]]["scores"] = json.loads(score["scores"])
    unscored = [number for number, row in rows.items() if "scores" not in row]
    for begin in range(0, len(unscored), BATCH):
        numbers, scored = unscored[begin : begin + BATCH], []
        keys = [(rows[number]["sequence"], rows[number]["fingerprint"]) for number in numbers]
        # Another process can remove or damage runs after their rows were read.
        run_keys = [run_key(rows[number]) for number in numbers]
        runs, truths = results.read_all(run_keys, {*keys}, on_damage=warn_of_damage)
        for done, (number, key) in enumerate(zip(numbers, keys, strict=True), begin + 1):
            row = rows[number]
            run, truth = runs.pop(run_key(row), None), truths.get(key)
            if run is None or truth is None:
                del rows[number]
                continue
            row["scores"] = _scores(run, truth)
            scored.append(row)
            progress(done, len(unscored))
        with suppress(ResultsError):  # in a read-only folder, every reader computes the scores
            store_scores(results, scored)
    return list(rows.values()), requests


def run_row(run: Run, truth: Any) -> dict[str, Any]:
    """Return the row of a run, with scores."""
    ended = run.status, run.failure, run.identity.repetition, len(run.boxes)
    fields = _fields(run.metadata, *ended)
    return {**_identity_fields(run.identity), **fields, "scores": _scores(run, truth)}


def store_scores(results: RunStore, rows: Iterable[Mapping[str, Any]]) -> None:
    """Store the scores of rows, unless their runs were replaced or removed in the meantime.

    Raises `ResultsError` if they cannot be written.
    """
    key = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
    query = f"SELECT id FROM run WHERE {key} AND version = ? AND status = ?"
    with open_database(results.folder, write=True) as database:
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


def _read_rows(database: Database) -> list[tuple[int, dict[str, Any]]]:
    """Return the database id and the row of each undamaged run with ground truth, in order."""
    damaged = database.select("SELECT sequence, fingerprint FROM truth")
    truths = {row[:2] for row in database.rows("truth", on_damage=warn_of_damage)}
    is_damaged = {row[:2] for row in damaged} - truths
    shared: dict[str, dict[str, Any]] = {}
    rows = []
    for row in database.rows("run", on_damage=warn_of_damage):
        truth = row["sequence"], row["fingerprint"]
        if truth not in truths:
            if truth not in is_damaged:
                warn_of_damage(MissingTruthError(database.path, *truth))
            continue
        version = row["version"]
        if version not in shared:
            shared[version] = _identity_fields(identity_of(row))
        ended = row["status"], row["failure"], row["repetition"], row["frames"]
        rows.append((row["id"], shared[version] | _fields(json.loads(row["metadata"]), *ended)))
    return sorted(rows, key=lambda numbered: sort_key(run_key(numbered[1])))


def _fields(
    metadata: Mapping[str, Any], status: str, failure: str, repetition: int, frames: int
) -> dict[str, Any]:
    return {
        "status": status,
        "failure": failure,
        "generators": ", ".join(metadata.get("generators", ())),
        **{name: metadata.get(name, "") for name in _METADATA_TEXTS},
        "repetition": repetition,
        "frames": frames,
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
