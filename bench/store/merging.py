"""Results of several folders brought together into one."""

from pathlib import Path

from bench.store.files import write_atomically
from bench.store.index import experiment_folders, read_index
from bench.store.results import Results
from bench.store.seal import read_sealed
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
    there = {row["path"]: (row["version"], row["status"], target) for row in read_index(into)}
    asked = into.asked()
    wanted: list[tuple[Results, Path, Path]] = []
    conflicts: list[str] = []
    for folder in [found for source in sources for found in experiment_folders(source)]:
        results = Results(folder)
        asked = results.asked().and_then(asked)
        for row in read_index(results):
            path = row["path"]
            if path in there:
                version, status, other = there[path]
                if version != row["version"]:
                    conflicts.append(f"{path} differs between {other} and {folder}")
                if status == "finished" or row["status"] == "failed":
                    continue
            there[path] = (row["version"], row["status"], folder)
            truth = truth_path(folder, row["sequence"], row["fingerprint"])
            wanted.append((results, truth.relative_to(folder), Path(path)))
    if conflicts:
        return 0, conflicts
    into.prepare(asked)
    for results, truth, run in wanted:
        if not (target / truth).is_file():
            write_atomically(target / truth, read_sealed(results.folder / truth))
        into.write(results.read(results.folder / run))
    read_index(into)
    return len({run for _, _, run in wanted}), []
