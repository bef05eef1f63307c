"""Names that the store uses: the key of a run, and folders of experiments.

```
<experiment>/runs.db      requested and stored runs, ground truths, scores and log; see `database`
```

Reports and other files of commands lie in the same folder. The store reads none of them.
"""

from pathlib import Path
from typing import Any, TypeAlias

from trackmark.bench.store.files import ResultsError

DATABASE = "runs.db"
"""Name of the file that holds the results of an experiment."""

RunKey: TypeAlias = tuple[str, str, int, str]
"""Key of a run: tracker, sequence, repetition, protocol."""

RUN_KEY_COLUMNS = ("tracker", "sequence", "repetition", "protocol")
"""Names of the fields of a `RunKey` in rows and data frames."""


def run_key(row: Any) -> RunKey:
    """Return the key of a run from its row, or from its `Identity`."""
    fields = row if hasattr(row, "keys") else vars(row)  # `sqlite3.Row` is no `Mapping`
    return fields["tracker"], fields["sequence"], int(fields["repetition"]), fields["protocol"]


def refuse_parquet_layout(folder: Path) -> None:
    """Raise `ResultsError` for a folder with Parquet files of an older trackmark."""
    if (folder / "plan.json").is_file() and not (folder / DATABASE).exists():
        raise ResultsError(
            f"{folder} holds results as Parquet files, which an older trackmark wrote. Expected "
            f"{DATABASE}. Convert them once: `trackmark results convert {folder}`."
        )


def experiment_folders(folder: Path) -> list[Path]:
    """Return the experiments in a folder: the folder itself, or folders directly in it.

    Raises `ResultsError` if there are none, or one holds results of an older trackmark.
    """
    candidates = [folder, *sorted(folder.glob("*/"))] if folder.is_dir() else []
    for path in candidates:
        refuse_parquet_layout(path)
    folders = [path for path in candidates if (path / DATABASE).is_file()]
    if not folders:
        raise ResultsError(f"{folder}: there are no results here. `trackmark run` makes some.")
    return folders
