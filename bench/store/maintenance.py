"""Maintenance of stored results: search for damage, merging, and sequences of equal name."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from trackmark.bench.store.database import DamagedError, open_database
from trackmark.bench.store.keys import (
    FILE_NAME,
    ResultsError,
    RunKey,
    experiment_folders,
    refuse_empty_file,
    run_key,
)
from trackmark.bench.store.run_rows import StoredRuns
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import MissingTruthError, pack_truth

_WITHOUT_TRUTH = """
    SELECT sequence, fingerprint FROM run EXCEPT SELECT sequence, fingerprint FROM truth
"""
_BATCH = 200  # runs that are copied in one transaction


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
            data = SequenceOrigin(row["fingerprint"], row["source"], row["truth"])
            by_name.setdefault(row["sequence"], set()).add(data)
    return by_name


def find_other_origin(
    origin: SequenceOrigin, candidates: Iterable[SequenceOrigin]
) -> SequenceOrigin | None:
    """Return a candidate whose content and path differ from those of `origin`; None if none does.

    A sequence that changed in the same folder does not count: its runs are stale.
    """
    for candidate in candidates:
        if (
            candidate.fingerprint != origin.fingerprint
            and candidate.real_paths != origin.real_paths
        ):
            return candidate
    return None


def find_damage(folder: Path) -> list[str]:
    """Return one message per damage; an empty list if the file is intact.

    Raises `ResultsError` if the file cannot be read for another reason, such as a newer schema.
    """
    try:
        refuse_empty_file(folder)
    except ResultsError as error:
        return [str(error)]
    try:
        with open_database(folder) as database:
            messages = database.find_damage()
            without_truth = [] if messages else database.select(_WITHOUT_TRUTH)
    except DamagedError as error:
        return [str(error)]
    return messages + [
        str(MissingTruthError(folder / FILE_NAME, *truth)) for truth in without_truth
    ]


def merge_results(sources: list[Path], target: Path) -> tuple[int, list[str]]:
    """Copy runs of experiments into an experiment.

    `sources` are folders of experiments, or folders that contain experiments. `target` is the
    folder of an experiment; it is created if it is missing.

    Returns the number of copied runs, and messages on conflicts: different versions of a tracker,
    or different sequences with equal names. If there are conflicts, nothing is copied.

    Raises `ResultsError` if a folder has no results or a file cannot be read or written.
    """
    store, stored_runs = RunStore(target), StoredRuns.read(target, keeps_runs=False)
    present, requests = stored_runs.rows, stored_runs.requests
    target_runs = {run_key(row): (row["version"], row["status"], target) for row in present}
    origins_of_name = origins_by_name(present)
    tracker_versions = {row["tracker"]: (row["tracker_version"], target) for row in present}
    missing: dict[RunKey, tuple[StoredRuns, tuple[str, str]]] = {}
    conflicts: list[str] = []
    for folder in [path for source in sources for path in experiment_folders(source)]:
        stored_runs = StoredRuns.read(folder)
        requests = stored_runs.requests.merged_with(requests)
        for name, origins in origins_by_name(stored_runs.rows).items():
            earlier = origins_of_name.setdefault(name, set())
            conflicts += [
                f"{name} is {recorded} in {folder}, and {different} in another folder"
                for recorded in sorted(origins)
                if (different := find_other_origin(recorded, earlier))
            ]
            earlier |= origins
        for row in stored_runs.rows:
            key, origin = run_key(row), (row["tracker_version"], folder)
            version, other = tracker_versions.setdefault(row["tracker"], origin)
            if key not in target_runs and other != folder and version != row["tracker_version"]:
                conflict = f"the versions of {key[0]} differ between {other} and {folder}"
                conflicts += [] if conflict in conflicts else [conflict]
            if key in target_runs:
                version, status, other = target_runs[key]
                if version != row["version"]:
                    conflicts.append(
                        f"{key[0]} on {key[1]}, repetition {key[2]}, differs between {other} "
                        f"and {folder}"
                    )
                if status == "finished" or row["status"] == "failed":
                    continue
            target_runs[key] = (row["version"], row["status"], folder)
            missing[key] = stored_runs, (row["sequence"], row["fingerprint"])
    if conflicts:
        return 0, conflicts
    store.add_requests(requests)
    keys = list(missing)
    for begin in range(0, len(keys), _BATCH):
        batch = {key: missing[key] for key in keys[begin : begin + _BATCH]}
        truths = {truth: stored_runs.truth(*truth) for stored_runs, truth in batch.values()}
        store.add_all(
            [(stored_runs.run(key), "") for key, (stored_runs, _) in batch.items()],
            [pack_truth(fingerprint, truth) for (_, fingerprint), truth in truths.items()],
        )
    StoredRuns.read(target).scored_rows(lambda *_: None)
    return len(missing), []
