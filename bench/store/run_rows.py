"""Rows of stored runs with their scores. Scores are computed once for each run and scorer."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache, partial
from math import isfinite
from pathlib import Path
from typing import Any

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_judge, score_both
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.store.database import Database, open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE, run_key
from trackmark.bench.store.results import Results, order
from trackmark.bench.store.truth import read_truth

SCORED_BY = ("centre_error", "native", "overlap", "regions", "times")
"""Modules of `bench.metrics` that define the stored scores; other presets change none."""

TEXTS = (
    *("tracker", "tracker_name", "preset", "parameters", "version", "tracker_version"),
    *("sequence", "fingerprint", "protocol", "status", "failure", "source", "truth"),
)
"""Fields of a row that are texts."""

NUMBERS = ("repetition", "frames", "seconds", "frame_seconds", "update_seconds")
"""Fields of a row that are numbers."""

_BATCH = 1000  # runs that are scored in one transaction


def list_runs(results: Results) -> list[dict[str, Any]]:
    """Return the rows of finished and failed runs without scores, in order.

    The keys are `tracker`, `tracker_name`, `preset`, `parameters` (JSON), `version` (of tracker,
    parameters and sequence together), `tracker_version` (of the tracker's code and libraries), the
    fields `sequence`, `fingerprint`, `protocol`, `status`, `failure`, `source` and `truth` (paths
    from which the sequence was opened), `repetition`, `frames`, `seconds` of the tracker,
    `frame_seconds` to decode or render a frame, and `update_seconds` of CPU of an update (median).

    Raises `ResultsError` if the file is damaged.
    """
    with open_database(results.folder) as database:
        return [row for _, row in _listed(database)]


def list_scored_runs(
    results: Results, progress: Callable[[int, int], None] = lambda *_: None
) -> list[dict[str, Any]]:
    """Return the rows of `list_runs` with `scores` by name, of `bench.evaluation.score_both`.

    `progress`: called with the numbers of runs that have been scored, and of all that must be.

    Raises `ResultsError` if the file is damaged.
    """
    with open_database(results.folder) as database:
        listed = _listed(database)
        stored = {
            row["run"]: json.loads(row["scores"])
            for row in database.table("score")
            if row["scorer"] == _scorer_version()
        }
    unscored = [row for number, row in listed if number not in stored]
    truth = cache(partial(read_truth, results.folder))
    for begin in range(0, len(unscored), _BATCH):
        batch = unscored[begin : begin + _BATCH]
        for place, row in enumerate(batch, begin + 1):
            run = results.read(run_key(row))
            stored_truth = truth(row["sequence"], row["fingerprint"])
            try:
                row["scores"] = _scores(run, stored_truth)
            except ValueError as error:
                raise ResultsError(
                    f"{results.folder / DATABASE}: {run} is damaged ({error}). Remove the run "
                    "(`trackmark results remove`) and run the same command again."
                ) from error
            progress(place, len(unscored))
        with suppress(ResultsError):  # a read-only folder is read more slowly
            add_scores(results, batch)
    return [{**row, "scores": stored.get(number, row.get("scores"))} for number, row in listed]


def run_row(run: Run, truth: Any) -> dict[str, Any]:
    """Return the row of a run, with scores by its ground truth."""
    ended = run.status, run.failure, run.identity.repetition, len(run.boxes)
    fields = _fields(run.circumstances, *ended)
    return {**_of_identity(run.identity), **fields, "scores": _scores(run, truth)}


def add_scores(results: Results, rows: Iterable[Mapping[str, Any]]) -> None:
    """Store the scores of rows, unless their runs were replaced or removed meanwhile.

    Raises `ResultsError` if they cannot be written.
    """
    with open_database(results.folder, write=True) as database:
        for row in rows:
            key = "tracker = ? AND sequence = ? AND repetition = ? AND protocol = ?"
            where = f"SELECT id FROM run WHERE {key} AND version = ? AND status = ?"
            places = (*run_key(row), row["version"], row["status"])
            for run in database.select(where, *places):
                database.delete("score", "run = ?", run["id"])
                scores = run["id"], _scorer_version(), json.dumps(row["scores"])
                database.insert("score", [scores])


def to_json_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row for JSON, with null for scores that are not finite."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {**row, "scores": scores}


def _listed(database: Database) -> list[tuple[int, dict[str, Any]]]:
    """Return the numbers and rows of all runs."""
    identities = {row["version"]: json.loads(row["identity"]) for row in database.table("tracker")}
    shared: dict[str, dict[str, Any]] = {}
    listed = []
    for row in database.table("run"):
        version = row["version"]
        if version not in shared:
            if version not in identities:
                raise database.damaged(f"the tracker with the version {version} is missing")
            shared[version] = _of_identity(Identity(**identities[version], repetition=0))
        circumstances = json.loads(row["circumstances"])
        ended = row["status"], row["failure"], row["repetition"], row["frames"]
        listed.append((row["id"], {**shared[version], **_fields(circumstances, *ended)}))
    return sorted(listed, key=lambda one: order(run_key(one[1])))


def _fields(
    circumstances: Mapping[str, Any], status: str, failure: str, repetition: int, frames: int
) -> dict[str, Any]:
    return {
        "status": status,
        "failure": failure,
        "source": circumstances.get("source", ""),
        "truth": circumstances.get("truth", ""),
        "repetition": repetition,
        "frames": frames,
        **{name: circumstances.get(name) for name in NUMBERS[2:]},
    }


def _of_identity(identity: Identity) -> dict[str, Any]:
    return {
        "tracker": identity.tracker,
        "tracker_name": identity.tracker_name,
        "preset": identity.preset,
        "parameters": json.dumps(identity.parameters, sort_keys=True),
        "version": identity.version,
        "tracker_version": identity.tracker_digest,
        "sequence": identity.sequence,
        "fingerprint": identity.fingerprint,
        "protocol": identity.protocol,
    }


def _scores(run: Run, truth: Any) -> dict[str, float]:
    """Return the scores by `native`; none if it cannot judge the run."""
    if run.failure or run.states is not None or not can_judge("native", run.identity.protocol):
        return {}
    return score_both(run, truth)


@cache
def _scorer_version() -> str:
    """Return a digest of the definition of the scores."""
    bench = Path(__file__).parents[1]
    files = [bench / "metrics" / f"{name}.py" for name in SCORED_BY]
    files.append(bench / "evaluation/scoring.py")
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
