"""Keys of runs, and folders of experiments.

```
<experiment>/runs.db      requested and stored runs, ground truths and scores; see `database`
```

Reports and other files of commands lie in the same folder. The store reads none of them.
"""

from pathlib import Path
from typing import Any, TypeAlias

from trackmark.datasets.spec_string import close_match


class ResultsError(ValueError):
    """Error in reading or writing results; the message names the folder or file."""


class DamagedError(ResultsError):
    """Error for content that is not what was written, or is missing; the message names the file."""


FILE_NAME = "runs.db"
"""Name of the file that holds the results of an experiment."""

RunKey: TypeAlias = tuple[str, str, int, str]
"""Key of a run: tracker (label), sequence, repetition, protocol."""

RUN_KEY_COLUMNS = ("tracker", "sequence", "repetition", "protocol")
"""Names of the fields of a `RunKey` in rows and data frames."""


def run_key(row: Any) -> RunKey:
    """Return the key of a run from its row, or from its `Identity`."""
    fields = row if hasattr(row, "keys") else vars(row)  # `sqlite3.Row` is not a `Mapping`
    return fields["tracker"], fields["sequence"], int(fields["repetition"]), fields["protocol"]


def refuse_empty_file(folder: Path) -> None:
    """Raise `DamagedError` for a results file of zero bytes, which trackmark never leaves."""
    file = folder / FILE_NAME
    if file.is_file() and not file.stat().st_size:
        raise DamagedError(
            f"{file} is damaged: it has 0 bytes. Restore the file from a backup, or remove it and "
            "run the same command again."
        )


def experiment_folders(folder: Path, *, damaged: bool = False) -> list[Path]:
    """Return the experiments' folders: the folder itself, and its subfolders with results.

    `damaged`: also return folders with an empty file.

    Raises `ResultsError` if there are none, or if one has an empty file.
    """
    candidates = [folder, *sorted(folder.glob("*/"))] if folder.is_dir() else []
    folders = [path for path in candidates if (path / FILE_NAME).is_file()]
    for path in folders if not damaged else ():
        refuse_empty_file(path)
    if not folders:
        raise no_results(folder)
    return folders


def no_results(folder: Path) -> ResultsError:
    """Return the error for a folder without results; it names a folder of a similar name."""
    others = [file.parent.name for file in folder.parent.glob(f"*/{FILE_NAME}")]
    return ResultsError(
        f"{folder}: this folder contains no results.{close_match(folder.name, others)} "
        "`trackmark run` creates results."
    )


def single_experiment(folder: Path) -> Path:
    """Return the folder of the only experiment in a folder, which may be the folder itself.

    Raises `ResultsError` if there is none, or if there are several.
    """
    experiments = experiment_folders(folder)
    if len(experiments) > 1:
        names = ", ".join(map(str, experiments))
        raise ResultsError(f"{folder} contains several experiments. Choose one of {names}.")
    return experiments[0]
