"""Results of several folders brought together into one."""

import shutil
from pathlib import Path

from bench.store.files import write_atomically
from bench.store.index import experiment_folders, read_index
from bench.store.results import SIDE_SUFFIXES, Results, beside
from bench.store.truth import truth_path

__all__ = ["merge_results"]


def merge_results(sources: list[Path], target: Path) -> tuple[int, list[str]]:
    """Copy runs of experiments into an experiment.

    Parameters
    ----------
    sources : list of Path
        Folders of experiments, or folders that hold such.
    target : Path
        The experiment's folder; made where it is not there.

    Returns
    -------
    copied : int
        Number of runs copied; 0 where there are conflicts.
    conflicts : list of str
        Runs that lie in two folders with different identities.

    Raises
    ------
    ResultsError
        Where a folder holds no results or a file can't be read or written.
    """
    into = Results(target)
    there = {row["path"]: (row["digest"], target) for row in read_index(into)}
    asked = into.asked()
    wanted: list[tuple[Path, Path]] = []
    conflicts: list[str] = []
    for folder in [found for source in sources for found in experiment_folders(source)]:
        results = Results(folder)
        asked = results.asked().and_then(asked)
        for row in read_index(results):
            path = row["path"]
            if path in there:
                digest, other = there[path]
                if digest != row["digest"]:
                    conflicts.append(f"{path} differs between {other} and {folder}")
                continue
            there[path] = (row["digest"], folder)
            truth = truth_path(folder, row["sequence"], row["fingerprint"])
            wanted.append((folder, truth.relative_to(folder)))
            wanted += [
                (folder, beside(Path(path), suffix))
                for suffix in SIDE_SUFFIXES
                if beside(folder / path, suffix).is_file()
            ]
            wanted.append((folder, Path(path)))
    if conflicts:
        return 0, conflicts
    into.prepare(asked)
    for folder, path in wanted:
        _copy(folder / path, target / path)
    read_index(into)
    return sum(path.suffix == ".parquet" for _, path in wanted), []


def _copy(source: Path, target: Path) -> None:
    if not target.is_file() or target.suffix == ".parquet":
        write_atomically(target, lambda file: _copy_bytes(source, file))


def _copy_bytes(source: Path, target: Path) -> None:
    shutil.copyfile(source, target)
