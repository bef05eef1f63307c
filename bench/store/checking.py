"""Whether everything in an experiment's folder still is what was written."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from bench.store.asked import read_asked
from bench.store.files import ResultsError
from bench.store.log import log_files, read_log
from bench.store.results import Results
from bench.store.seal import read_sealed
from bench.store.truth import read_truth, truth_path

__all__ = ["Check", "checks", "damage"]

Check = Callable[[], object]
"""Reads a stored file, and raises what `damage` understands."""


def checks(folder: Path) -> list[Check]:
    """A check of every file of an experiment, but those of unfinished runs.

    Parameters
    ----------
    folder : Path
        The experiment's folder.
    """
    index = folder / "index.arrow"
    return [
        partial(read_asked, folder),
        *(partial(_read_run, Results(folder), file) for file in Results(folder).files()),
        *(partial(read_sealed, file) for file in sorted(folder.glob("_truth/*/*.arrow"))),
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
