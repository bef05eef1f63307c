"""Maintenance of stored results: check, merge, and data of the same name."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from trackmark.bench.store.database import open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import RunKey, experiment_folders, run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_runs, list_scored_runs
from trackmark.bench.store.truth import read_truth, store_truth

_BATCH = 200  # runs that are copied in one transaction


class RecordedData(NamedTuple):
    """Recorded data that runs were made on."""

    fingerprint: str  # as in `datasets.Sequence`
    source: str  # path from which it was opened
    truth: str  # path of its ground truth if that was given; else empty

    def __str__(self) -> str:
        return f"{self.source} with the truth {self.truth}" if self.truth else self.source

    @property
    def place(self) -> tuple[str, str]:
        """Real paths."""
        return os.path.realpath(self.source), self.truth and os.path.realpath(self.truth)


def recorded_data(rows: Iterable[Mapping[str, Any]]) -> dict[str, set[RecordedData]]:
    """Return the recorded data of rows of runs, by the names of their sequences."""
    found: dict[str, set[RecordedData]] = {}
    for row in rows:
        if Path(row["source"]).is_absolute():  # built-in sequences have names
            one = RecordedData(row["fingerprint"], row["source"], row["truth"])
            found.setdefault(row["sequence"], set()).add(one)
    return found


def different(one: RecordedData, others: Iterable[RecordedData]) -> RecordedData | None:
    """Return one of the others with other data; None if there is none.

    Data that were changed in their folder count as the same data, and runs on them as stale.
    """
    for other in others:
        if other.fingerprint != one.fingerprint and other.place != one.place:
            return other
    return None


def find_damage(folder: Path) -> list[str]:
    """Return a sentence for each damage of an experiment's file; none if it is undamaged."""
    try:
        with open_database(folder) as database:
            found = database.find_damage()
        if found:
            return found
        for row in list_runs(Results(folder)):
            Results(folder).read(run_key(row))
            read_truth(folder, row["sequence"], row["fingerprint"])
    except ResultsError as error:
        return [str(error)]
    return []


def merge_results(sources: list[Path], target: Path) -> tuple[int, list[str]]:
    """Copy runs of experiments into an experiment.

    `sources`: folders of experiments, or folders that contain experiments. `target`: the
    experiment's folder; made if it is missing.

    Returns the number of copied runs, and the conflicts: runs that are stored in two folders with
    different identities. If there are conflicts, nothing is copied.

    Raises `ResultsError` if a folder has no results or a file cannot be read or written.
    """
    into = Results(target)
    present = list_runs(into)
    there = {run_key(row): (row["version"], row["status"], target) for row in present}
    known = recorded_data(present)
    manifest = into.manifest()
    wanted: dict[RunKey, tuple[Results, dict[str, Any]]] = {}
    conflicts: list[str] = []
    for folder in [found for source in sources for found in experiment_folders(source)]:
        results = Results(folder)
        manifest = results.manifest().merged_with(manifest)
        rows = list_runs(results)
        for name, data in recorded_data(rows).items():
            others = known.setdefault(name, set())
            conflicts += [
                f"{name} is {one} in {folder}, and {unlike} in another folder"
                for one in sorted(data)
                if (unlike := different(one, others))
            ]
            others |= data
        for row in rows:
            cell = run_key(row)
            if cell in there:
                version, status, other = there[cell]
                if version != row["version"]:
                    conflicts.append(
                        f"{cell[0]} on {cell[1]}, repetition {cell[2]}, differs between {other} "
                        f"and {folder}"
                    )
                if status == "finished" or row["status"] == "failed":
                    continue
            there[cell] = (row["version"], row["status"], folder)
            wanted[cell] = results, row
    if conflicts:
        return 0, conflicts
    into.prepare(manifest)
    for results, row in wanted.values():
        truth = row["sequence"], row["fingerprint"]
        store_truth(target, truth[1], read_truth(results.folder, *truth))
    cells = list(wanted)
    for begin in range(0, len(cells), _BATCH):
        batch = cells[begin : begin + _BATCH]
        into.write_all((wanted[cell][0].read(cell), "") for cell in batch)
    list_scored_runs(into)
    return len(wanted), []
