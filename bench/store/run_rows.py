"""Rows of runs: what tables and plans need to know of a run, and its scores."""

import json
import os
from collections.abc import Iterable, Mapping
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import score_both
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.times import TIME_FIELDS
from trackmark.bench.store.truth import StoredTruth
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


def row_of(
    identity: Mapping[str, Any],
    metadata: Mapping[str, Any],
    repetition: int,
    status: str,
    failure: str,
    n_frames: int,
) -> dict[str, Any]:
    """Return the row of a run, without scores; see `Runs.stored_rows` for its fields.

    `identity` contains the result of `identity_fields`, which runs of one version share.
    """
    return {
        **identity,
        "status": status,
        "failure": failure,
        "generators": ", ".join(metadata.get("generators", ())),
        **{name: metadata.get(name, "") for name in _METADATA_TEXTS},
        "repetition": repetition,
        "frames": n_frames,
        **{name: metadata.get(name) for name in NUMBER_FIELDS[2:]},
    }


def identity_fields(identity: Identity) -> dict[str, Any]:
    """Return the fields of a row that depend on the identity, except the repetition."""
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


def run_row(run: Run, truth: StoredTruth | None) -> dict[str, Any]:
    """Return the row of a run, with scores if a ground truth is given."""
    repetition, n_frames = run.identity.repetition, len(run.boxes)
    fields = identity_fields(run.identity)
    row = row_of(fields, run.metadata, repetition, run.status, run.failure, n_frames)
    return row if truth is None else {**row, "scores": score_both(run, truth)}


@cache
def scorer_version() -> str:
    """Return the version of the code that computes the stored scores."""
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


def json_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row in which None (null in JSON) replaces scores that are not finite."""
    scores = {key: value if isfinite(value) else None for key, value in row["scores"].items()}
    return {**row, "scores": scores}


class SequenceOrigin(NamedTuple):
    """Recorded sequence on which stored runs were made."""

    fingerprint: str  # fingerprint as in `datasets.Sequence`
    source: str  # path from which the sequence was opened
    truth: str  # path of the ground truth if it was given, otherwise empty

    def __str__(self) -> str:
        return f"{self.source} with the truth {self.truth}" if self.truth else self.source

    @property
    def real_paths(self) -> tuple[str, str]:
        """Real paths of sequence and ground truth."""
        return os.path.realpath(self.source), self.truth and os.path.realpath(self.truth)


def origins_by_name(rows: Iterable[Mapping[str, Any]]) -> dict[str, set[SequenceOrigin]]:
    """Return the recorded sequences that occur in rows of runs, by sequence name."""
    by_name: dict[str, set[SequenceOrigin]] = {}
    for row in rows:
        if Path(row["source"]).is_absolute():  # built-in sequences have their name as source
            origin = SequenceOrigin(row["fingerprint"], row["source"], row["truth"])
            by_name.setdefault(row["sequence"], set()).add(origin)
    return by_name


def find_other_origin(
    origin: SequenceOrigin, candidates: Iterable[SequenceOrigin]
) -> SequenceOrigin | None:
    """Return a candidate whose content and path differ from those of `origin`; None if none does.

    A sequence that changed in the same folder does not count: its runs are stale.
    """
    for other in candidates:
        if other.fingerprint != origin.fingerprint and other.real_paths != origin.real_paths:
            return other
    return None
