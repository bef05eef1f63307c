"""Maintenance of stored results: search for damage, and merging."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trackmark.bench.store.database import (
    FILE_NAME,
    DamagedError,
    RunKey,
    experiment_folders,
    open_database,
    refuse_empty_file,
    run_key,
)
from trackmark.bench.store.run_rows import SequenceOrigin, find_other_origin, origins_by_name
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.bench.store.truth import missing_truth

_WITHOUT_TRUTH = """
    SELECT sequence, fingerprint FROM run EXCEPT SELECT sequence, fingerprint FROM truth
"""
_BATCH = 200  # runs that are copied in one transaction


def find_damage(folder: Path) -> list[str]:
    """Return one message per damage; an empty list if the file is intact.

    Raises `ResultsError` if the file cannot be read for another reason, such as a newer schema.
    """
    try:
        refuse_empty_file(folder)
        with open_database(folder) as database:
            messages = database.find_damage()
            without_truth = [] if messages else database.select(_WITHOUT_TRUTH)
    except DamagedError as error:
        return [str(error)]
    return messages + [missing_truth(folder / FILE_NAME, *truth) for truth in without_truth]


def merge_results(sources: list[Path], target: Path) -> tuple[int, list[str]]:
    """Copy runs of experiments into an experiment.

    `sources` are folders of experiments, or folders that contain experiments. `target` is the
    folder of an experiment; it is created if it is missing.

    Returns the number of copied runs, and messages on conflicts: different versions of a tracker,
    or different sequences with equal names. If there are conflicts, nothing is copied.

    Raises `ResultsError` if a folder has no results or a file cannot be read or written.
    """
    folders = [path for source in sources for path in experiment_folders(source)]
    merged = [Runs.unscored(target, keeps_runs=False), *map(Runs.unscored, folders)]
    origins_of_name: dict[str, set[SequenceOrigin]] = {}
    tracker_versions: dict[str, tuple[str, Path | None]] = {}
    row_of_key: dict[RunKey, tuple[Mapping[str, Any], Runs]] = {}  # with the runs that have it
    conflicts: list[str] = []
    for runs in merged:
        folder = runs.folder
        for name, origins in origins_by_name(runs.stored_rows).items():
            earlier = origins_of_name.setdefault(name, set())
            conflicts += [
                f"{name} is {origin} in {folder}, and {other} in another folder"
                for origin in sorted(origins)
                if (other := find_other_origin(origin, earlier))
            ]
            earlier |= origins
        for row in runs.stored_rows:
            key, current = run_key(row), (row["tracker_version"], folder)
            version, first_folder = tracker_versions.setdefault(row["tracker"], current)
            if key in row_of_key:
                former, former_runs = row_of_key[key]
                if former["version"] != row["version"]:
                    conflicts.append(
                        f"{key[0]} on {key[1]}, repetition {key[2]}, differs between "
                        f"{former_runs.folder} and {folder}"
                    )
                if former["status"] == "finished" or row["status"] == "failed":
                    continue
            elif first_folder != folder and version != row["tracker_version"]:
                conflicts.append(
                    f"the versions of {key[0]} differ between {first_folder} and {folder}"
                )
            row_of_key[key] = row, runs
    if conflicts:
        return 0, list(dict.fromkeys(conflicts))
    store = RunStore(target)
    for runs in reversed(merged):  # of several versions and titles, those of the target count
        store.add_requests(runs.requested, runs.title)
    copied = [(row, runs) for row, runs in row_of_key.values() if runs is not merged[0]]
    for begin in range(0, len(copied), _BATCH):
        batch = [run for row, runs in copied[begin : begin + _BATCH] for run in runs.read([row])]
        truths = {(truth.name, truth.fingerprint): truth for _, _, truth in batch}
        store.add_all([(run, "") for _, run, _ in batch], truths.values())
    return len(copied), []
