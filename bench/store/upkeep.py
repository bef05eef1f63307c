"""Looking after stored results: whether they are what was written, and bringing them together."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from trackmark.bench.store.asked import read_asked
from trackmark.bench.store.checksum import read_sealed
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import index_rows, read_table
from trackmark.bench.store.layout import experiment_folders
from trackmark.bench.store.log import log_files, read_log
from trackmark.bench.store.recordings import different, recordings
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import check_truth, copy_truth, read_truth, truth_path

Check = Callable[[], object]
"""Reads a stored file, and raises what `damage` understands."""


def checks(folder: Path) -> list[Check]:
    """A check of every file of an experiment, but those of unfinished runs."""
    index = folder / "index.arrow"
    return [
        partial(read_asked, folder),
        *(partial(_read_run, Results(folder), file) for file in Results(folder).files()),
        *(partial(check_truth, file) for file in sorted(folder.glob("_truth/*/*.arrow"))),
        *(partial(_read_log, file) for file in log_files(folder)),
        *([partial(read_sealed, index)] if index.is_file() else []),
    ]


def damage(check: Check) -> str:
    """What is wrong with a file: a sentence that names it; empty where nothing is."""
    try:
        check()
    except (ResultsError, FileNotFoundError) as error:
        return str(error)
    return ""


def _read_run(results: Results, file: Path) -> None:
    """Read a run with its companions, and see that the truth by which it is scored is there."""
    key = results.read(file).identity
    if not truth_path(results.folder, key.sequence, key.fingerprint).is_file():
        read_truth(results.folder, key.sequence, key.fingerprint)  # says what to do


def _read_log(file: Path) -> None:
    for _ in read_log(file):
        pass


def merge_results(sources: list[Path], target: Path) -> tuple[int, list[str]]:
    """Copy runs of experiments into an experiment.

    `sources`: folders of experiments, or folders that hold such. `target`: the experiment's folder;
    made where it is not there.

    Gives the number of runs copied, and the conflicts: runs that lie in two folders with different
    identities. Where there are some, nothing is copied.

    Raises `ResultsError` where a folder holds no results or a file can't be read or written.
    """
    into = Results(target)
    present = read_table(into)
    there = {row["path"]: (row["version"], row["status"], target) for row in index_rows(present)}
    known = recordings(present)
    asked = into.asked()
    wanted: list[tuple[Results, dict[str, Any]]] = []
    conflicts: list[str] = []
    for folder in [found for source in sources for found in experiment_folders(source)]:
        results = Results(folder)
        asked = results.asked().and_then(asked)
        index = read_table(results)
        for name, data in recordings(index).items():
            others = known.setdefault(name, set())
            conflicts += [
                f"{name} is {one} in {folder}, and {unlike} in another folder"
                for one in sorted(data)
                if (unlike := different(one, others))
            ]
            others |= data
        for row in index_rows(index):
            path = row["path"]
            if path in there:
                version, status, other = there[path]
                if version != row["version"]:
                    conflicts.append(f"{path} differs between {other} and {folder}")
                if status == "finished" or row["status"] == "failed":
                    continue
            there[path] = (row["version"], row["status"], folder)
            wanted.append((results, row))
    if conflicts:
        return 0, conflicts
    into.prepare(asked)
    for results, row in wanted:
        copy_truth(results.folder, target, row["sequence"], row["fingerprint"])
        into.write(results.read(results.folder / row["path"]))
    read_table(into)
    return len({row["path"] for _, row in wanted}), []
