"""How the files of results are called, and the version of their layout.

```
<experiment>/<tracker>/<sequence>/<repetition>.parquet          a finished run, a row a frame
                                  <repetition>.<digest>.…       what belongs to it: revised boxes,
                                                                arrays
                                  <repetition>.unfinished.npy   frames of a run that has not ended
             _truth/<sequence>/<fingerprint>.arrow              what scores are computed against
             _log/<start>.jsonl                                 what was done, when, by whom
             index.arrow                                        a row a run; made anew at need
             plan.json                                          what was ever asked for
```

Trackers and sequences are canonical text forms, percent-encoded.
"""

import hashlib
from pathlib import Path
from typing import TypeAlias
from urllib.parse import quote

from trackmark.bench.store.files import ResultsError

SCHEMA = 2
"""Version of the layout; a reader refuses any other."""

METADATA_KEY = b"trackmark"
"""Where Parquet and Arrow files have what we say of them."""

BOX_COLUMNS = ("x", "y", "width", "height")

UNFINISHED = ".unfinished.npy"

_LONGEST_NAME = 200  # bytes; file systems take 255

Cell: TypeAlias = tuple[str, str, int, str]
"""Tracker, sequence, repetition, protocol: what a run is filed under."""


def run_path(tracker: str, sequence: str, repetition: int, protocol: str) -> Path:
    """Where a run lies, relative to the experiment's folder."""
    label = tracker if protocol == "accuracy" else f"{tracker}:protocol={protocol}"
    return Path(folder_name(label), folder_name(sequence), f"{repetition}.parquet")


def folder_name(label: str) -> str:
    """A label as one folder name: percent-encoded, and cut with a digest where it is long."""
    name = quote(label, safe="=")
    if name[:1] in ("_", "."):  # these begin the names of what is no run
        name = f"%{ord(name[0]):02X}{name[1:]}"
    if len(name) <= _LONGEST_NAME:
        return name
    digest = hashlib.sha256(label.encode()).hexdigest()[:16]
    return f"{name[: _LONGEST_NAME - 17]}~{digest}"


def beside(path: Path, suffix: str) -> Path:
    """File that lies beside a run: `3.parquet` has `3.unfinished.npy`."""
    return path.with_name(path.stem + suffix)


def run_of(path: Path) -> Path:
    """File of the run that a file lies beside, or is: of `3.unfinished.npy` it is `3.parquet`."""
    return path.with_name(path.name.partition(".")[0] + ".parquet")


def check_schema(file: Path, schema: object) -> None:
    """Refuse files of another layout.

    Raises `ResultsError` naming the file and both versions.
    """
    if schema != SCHEMA:
        raise ResultsError(
            f"{file} has the layout version {schema}; this trackmark reads version {SCHEMA}. "
            "Read it with the trackmark that wrote it, or run again into another folder."
        )


def experiment_folders(folder: Path) -> list[Path]:
    """Experiments in a folder: itself, or those right below it.

    Raises `ResultsError` where there are none.
    """
    candidates = [folder, *sorted(folder.glob("*/"))] if folder.is_dir() else []
    found = [path for path in candidates if (path / "plan.json").is_file()]
    if not found:
        raise ResultsError(f"{folder}: there are no results here. `trackmark run` makes some.")
    return found
