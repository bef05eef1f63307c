"""Results on disk: one Parquet file a run, the truth it is scored by, and an index of all.

```
results/<experiment>/<tracker>/<sequence>/<repetition>.parquet    a finished run, a row a frame
                                          <repetition>.revised.arrow, .arrays.npz   beside it
                     _truth/<sequence>/<fingerprint>.arrow        what scores are computed against
                     index.arrow                                  a row a run; made anew at need
                     plan.json                                    what was last asked for
```

Trackers and sequences are canonical text forms, percent-encoded. Whoever reads results
reads nothing but this folder.
"""

import hashlib
import json
import platform
import socket
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import quote

import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as parquet
from numpy.typing import NDArray

from bench.record import Identity, Run, Times
from bench.store.files import ResultsError, remove_leftovers, write_atomically

__all__ = [
    "BOX_COLUMNS",
    "METADATA_KEY",
    "SCHEMA",
    "SIDE_SUFFIXES",
    "Asked",
    "Cell",
    "Results",
    "beside",
    "check_schema",
    "folder_name",
    "run_path",
]

SCHEMA = 1
"""Version of the files' layout; a reader refuses what is newer."""

SIDE_SUFFIXES = (".revised.arrow", ".arrays.npz")
"""What may lie beside a run."""

METADATA_KEY = b"trackmark"
_CHECKSUM_KEY = b"trackmark.sha256"  # Parquet checks its pages, not its metadata
BOX_COLUMNS = ("x", "y", "width", "height")
_LONGEST_NAME = 200  # bytes; file systems take 255


Cell: TypeAlias = tuple[str, str, int, str]
"""Tracker, sequence, repetition, protocol: what a run is filed under."""


@dataclass(frozen=True)
class Asked:
    """What an experiment was asked for.

    Attributes
    ----------
    title : str
        Headline of its report.
    cells : mapping of Cell to str
        The version (`Identity.version`) that was asked for last, by cell.
    """

    title: str
    cells: Mapping[Cell, str]

    def and_then(self, later: "Asked") -> "Asked":
        """What was asked for, with what is asked for later; the later version of a cell counts."""
        now = {_series(cell): version for cell, version in later.cells.items()}
        cells = {cell: now.get(_series(cell), version) for cell, version in self.cells.items()}
        return Asked(later.title or self.title, {**cells, **later.cells})


def _series(cell: Cell) -> tuple[str, str, str]:
    tracker, sequence, _, protocol = cell
    return tracker, sequence, protocol


class Results:
    """The results of one experiment.

    Parameters
    ----------
    folder : Path
        `results/<experiment>`. It need not exist yet.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def prepare(self, asked: Asked) -> None:
        """Make the folder, and add to what was asked for so far.

        Raises
        ------
        ResultsError
            Where the folder can't be written, or was written by a newer version.
        """
        self._write_asked(self.asked().and_then(asked))
        remove_leftovers(self.folder)

    def asked(self) -> Asked:
        """What was asked for so far; empty for a new folder.

        Raises
        ------
        ResultsError
            Where the file is damaged or was written by a newer version.
        """
        file = self.folder / "plan.json"
        if not file.is_file():
            return Asked("", {})
        try:
            plan = json.loads(file.read_text("utf-8"))
            check_schema(file, plan["schema"])
            cells = {tuple(cell[:4]): cell[4] for cell in plan["cells"]}
            return Asked(plan["title"], cells)
        except (ValueError, KeyError, TypeError, IndexError) as error:
            if isinstance(error, ResultsError):
                raise
            raise ResultsError(
                f"{file} is damaged ({type(error).__name__}: {error}). Remove it and run again."
            ) from None

    def _write_asked(self, asked: Asked) -> None:
        cells = [[*cell, version] for cell, version in asked.cells.items()]
        text = json.dumps({"schema": SCHEMA, "title": asked.title, "cells": cells}, indent=1)
        write_atomically(self.folder / "plan.json", lambda path: _write_text(path, text))

    def path(self, identity: Identity) -> Path:
        """File of a run."""
        return self.folder / run_path(
            identity.tracker, identity.sequence, identity.repetition, identity.protocol
        )

    def files(self) -> list[Path]:
        """Files of all finished runs, in order."""
        return sorted(self.folder.glob("[!_.]*/*/*.parquet"))

    def write(self, run: Run) -> Path:
        """Write a run; whatever lay there under its name is replaced."""
        path = self.path(run.identity)
        n = len(run.boxes)
        columns: dict[str, Any] = {"frame": np.arange(n, dtype=np.int32)}
        columns |= dict(zip(BOX_COLUMNS, np.ascontiguousarray(run.boxes.T), strict=True))
        columns |= {"visible": run.visible, "confidence": run.confidence}
        columns |= run.details
        metadata: dict[str, Any] = {
            "schema": SCHEMA,
            "identity": asdict(run.identity),
            "digest": run.identity.digest,
            "status": run.status,
            "failure": run.failure,
            "details": list(run.details),
            "circumstances": {
                "date": datetime.now(UTC).isoformat(timespec="seconds"),
                "host": socket.gethostname(),
                "platform": platform.platform(),
                "python": platform.python_version(),
                **run.circumstances,
            },
        }
        if run.times is not None:
            columns |= {"wall_seconds": run.times.wall, "cpu_seconds": run.times.cpu}
            metadata["initialisation"] = [
                run.times.initialisation_wall,
                run.times.initialisation_cpu,
            ]
        # What lies beside a run is written first: a run that is there is complete.
        _write_beside(path, ".revised.arrow", _revised_writer(run))
        _write_beside(path, ".arrays.npz", _arrays_writer(run))
        text = json.dumps(metadata).encode()
        table = pa.table(columns).replace_schema_metadata(
            {METADATA_KEY: text, _CHECKSUM_KEY: _checksum(text)}
        )
        write_atomically(
            path,
            lambda file: parquet.write_table(
                table, file, compression="zstd", write_page_checksum=True
            ),
        )
        return path

    def remove(self, path: str) -> None:
        """Remove a run and what lies beside it; `path` is relative to the folder.

        It is no longer asked for, either.
        """
        asked = self.asked()
        kept = {cell: v for cell, v in asked.cells.items() if str(run_path(*cell)) != path}
        if len(kept) < len(asked.cells):
            self._write_asked(Asked(asked.title, kept))
        file = self.folder / path
        file.unlink(missing_ok=True)
        for suffix in SIDE_SUFFIXES:
            beside(file, suffix).unlink(missing_ok=True)
        for parent in (file.parent, file.parent.parent):
            if not any(parent.iterdir()):
                parent.rmdir()

    def read(self, path: Path) -> Run:
        """Read a run.

        Raises
        ------
        ResultsError
            Naming a file that is damaged or was written by a newer version.
        """
        try:
            table = parquet.read_table(path, page_checksum_verification=True)
            return _run(path, table, _metadata(table))
        except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
            if isinstance(error, ResultsError):
                raise
            raise ResultsError(
                f"{path} is damaged ({error}). Remove it and run the same command again."
            ) from error


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
    """File that lies beside a run: `3.parquet` has `3.revised.arrow`."""
    return path.with_name(path.stem + suffix)


def check_schema(file: Path, schema: object) -> None:
    """Refuse files of another layout.

    Raises
    ------
    ResultsError
        Naming the file and both versions.
    """
    if schema != SCHEMA:
        raise ResultsError(
            f"{file} has the layout version {schema}; this trackmark reads version {SCHEMA}. "
            "Read it with the trackmark that wrote it, or run again into another folder."
        )


def _metadata(table: pa.Table) -> dict[str, Any]:
    text = table.schema.metadata[METADATA_KEY]
    if table.schema.metadata[_CHECKSUM_KEY] != _checksum(text):
        raise ValueError("its metadata have changed")
    metadata: dict[str, Any] = json.loads(text)
    return metadata


def _checksum(text: bytes) -> bytes:
    return hashlib.sha256(text).hexdigest().encode()


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")


def _write_beside(path: Path, suffix: str, write: Callable[[Path], None] | None) -> None:
    """Write a file beside a run, or remove what an earlier run left there."""
    file = beside(path, suffix)
    if write is not None:
        write_atomically(file, write)
    else:
        file.unlink(missing_ok=True)


def _revised_writer(run: Run) -> Callable[[Path], None] | None:
    if run.revised is None:
        return None
    table = pa.table(dict(zip(BOX_COLUMNS, np.ascontiguousarray(run.revised.T), strict=True)))
    return lambda file: feather.write_feather(table, str(file))


def _arrays_writer(run: Run) -> Callable[[Path], None] | None:
    if not run.arrays:
        return None
    flat = {
        f"{frame}/{name}": array
        for frame, arrays in run.arrays.items()
        for name, array in arrays.items()
    }

    def write(file: Path) -> None:
        with file.open("wb") as stream:
            np.savez_compressed(stream, **flat)  # type: ignore[arg-type]  # the stub mistakes ** for its flag

    return write


def _run(path: Path, table: pa.Table, metadata: Mapping[str, Any]) -> Run:
    check_schema(path, metadata["schema"])
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    times = None
    if "initialisation" in metadata:
        times = Times(columns["wall_seconds"], columns["cpu_seconds"], *metadata["initialisation"])
    return Run(
        identity=Identity(**metadata["identity"]),
        boxes=_boxes(columns),
        visible=columns["visible"],
        confidence=columns["confidence"],
        details={name: columns[name] for name in metadata["details"]},
        failure=metadata["failure"],
        revised=_read_revised(path),
        arrays=_read_arrays(path),
        times=times,
        circumstances=metadata["circumstances"],
    )


def _boxes(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    return np.column_stack([columns[name] for name in BOX_COLUMNS])


def _read_revised(path: Path) -> NDArray[np.float64] | None:
    file = beside(path, ".revised.arrow")
    if not file.is_file():
        return None
    table = feather.read_table(file, memory_map=False)
    return _boxes({name: table.column(name).to_numpy() for name in BOX_COLUMNS})


def _read_arrays(path: Path) -> dict[int, dict[str, NDArray[Any]]]:
    file = beside(path, ".arrays.npz")
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    if file.is_file():
        with np.load(file, allow_pickle=False) as archive:
            for key in archive.files:
                frame, _, name = key.partition("/")
                arrays.setdefault(int(frame), {})[name] = archive[key]
    return arrays
