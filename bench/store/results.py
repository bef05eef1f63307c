"""Results on disk: one Parquet file a run, and what is asked for beside them.

Whoever reads results reads nothing but their folder; `bench.store.layout` says what lies in it.
"""

import hashlib
import io
import json
import platform
import socket
import zipfile
from collections.abc import Hashable, Mapping
from contextlib import nullcontext
from contextvars import ContextVar
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times
from trackmark.bench.store.asked import Asked, add_asked, read_asked, withdraw
from trackmark.bench.store.checksum import (
    PLACEHOLDER,
    SEAL_KEY,
    arrow_bytes,
    arrow_table,
    read_sealed,
    sealed,
)
from trackmark.bench.store.columns import as_columns
from trackmark.bench.store.files import (
    ResultsError,
    locked,
    remove_empty_folder,
    remove_file,
    write_atomically,
    write_once,
)
from trackmark.bench.store.layout import (
    BOX_COLUMNS,
    METADATA_KEY,
    SCHEMA,
    UNFINISHED,
    beside,
    check_schema,
    run_path,
)
from trackmark.bench.store.unfinished import remove_leftovers
from trackmark.datasets.source_digest import library_versions

_DIGITS = 16  # of a companion's digest, in its name


class Results:
    """The results of one experiment.

    `folder`: `results/<experiment>`. It need not exist yet.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def prepare(self, asked: Asked) -> None:
        """Make the folder, and add to what was asked for so far.

        Raises `ResultsError` where the folder can't be written, or has another layout.
        """
        add_asked(self.folder, asked)
        remove_leftovers(self.folder)

    def asked(self) -> Asked:
        """What was asked for so far; empty for a new folder.

        Raises `ResultsError` where the file is damaged or has another layout.
        """
        return read_asked(self.folder)

    def path(self, identity: Identity) -> Path:
        """File of a run."""
        return self.folder / run_path(
            identity.tracker, identity.sequence, identity.repetition, identity.protocol
        )

    def files(self) -> list[Path]:
        """Files of all finished runs, in order."""
        return sorted(self.folder.glob("[!_.]*/*/*.parquet"))

    def write(self, run: Run, replaces: str = "") -> bool:
        """Write a run, unless another one was finished in its place meanwhile.

        `run`: finished or failed. `replaces`: version of the run that may be replaced; empty where
        nothing lay there when this one was planned. A finished run of the same version is never
        replaced.

        Gives whether it was written. If not, what lies there was written by another process, and
        stays as it is.

        Raises `ResultsError` where it can't be written.
        """
        written = self._write(run, replaces)
        remove_file(beside(self.path(run.identity), UNFINISHED), durable=False)
        return written

    def remove(self, paths: list[str]) -> None:
        """Remove runs and what lies beside them; the paths are relative to the folder.

        They are no longer asked for, either.

        Raises `ResultsError` where one can't be removed.
        """
        withdraw(self.folder, paths)
        with locked(self.folder):
            for path in paths:
                file = self.folder / path
                remove_file(file)
                self._remove_companions(file, keep=set())
                remove_file(beside(file, UNFINISHED))
                for parent in (file.parent, file.parent.parent):
                    remove_empty_folder(parent)

    def read(self, path: Path) -> Run:
        """Read a run, within `kept_runs` only once.

        Raises `ResultsError` naming a file that is damaged or has another layout.
        """
        kept = kept_runs.get()
        if kept is None or not path.exists():
            return self._read(path)
        status = path.stat()
        key = *path.parts[-3:], status.st_ino, status.st_size, status.st_mtime_ns
        return kept.get(key) or kept.keep(key, self._read(path))

    def _read(self, path: Path) -> Run:
        try:
            content = read_sealed(path)
            # Not by `read_table`, whose threads may outlive the interpreter and abort it.
            table = parquet.ParquetFile(pa.BufferReader(content)).read(use_threads=False)
            metadata = json.loads(table.schema.metadata[METADATA_KEY])
            check_schema(path, metadata["schema"])
            place = self.path(_identity(metadata))
            if path.parts[-3:] != place.parts[-3:]:
                raise ResultsError(
                    f"{path} holds the run of another place, {place}. Move it there."
                )
            return _run(path, table, metadata)
        except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
            if isinstance(error, ResultsError):
                raise
            raise ResultsError(
                f"{path} is damaged ({error}). Remove it and run the same command again."
            ) from error

    def _write(self, run: Run, replaces: str) -> bool:
        path = self.path(run.identity)
        belonging = _companions(run)
        names = {
            kind: f"{path.stem}.{_digits(content)}.{kind}" for kind, content in belonging.items()
        }
        content = _run_file(run, names)
        if belonging or not write_once(path, content, locked(self.folder)):
            with locked(self.folder):
                if path.exists() and not self._may_be_replaced(path, run, replaces):
                    return False
                # What belongs to a run is written first: a run that is there is complete.
                for kind, name in names.items():
                    write_atomically(path.with_name(name), belonging[kind])
                if path.exists():
                    write_atomically(path, content)
                # Once, even under the lock: runs without companions come without it.
                elif not write_once(path, content, nullcontext()):
                    return False
                self._remove_companions(path, keep=set(names.values()))
        return True

    def _may_be_replaced(self, path: Path, run: Run, replaces: str) -> bool:
        present = self.read(path)
        if present.identity == run.identity:
            # What finished is never repeated, and always better than what failed.
            return bool(present.failure) and (replaces != "" or not run.failure)
        return present.identity.version == replaces

    def _remove_companions(self, path: Path, keep: set[str]) -> None:
        """Remove what belonged to earlier runs in this place."""
        for file in path.parent.glob(f"{path.stem}.*.*"):
            if file.name not in keep and not file.name.endswith(UNFINISHED):
                remove_file(file)


class KeptRuns(dict[Hashable, Run]):
    """Runs in memory, by what tells their files apart."""

    free = 1 << 30
    """Bytes that are left; runs that do not fit are read whenever they are needed."""

    def keep(self, key: Hashable, run: Run) -> Run:
        """Keep a run if it fits, and return it."""
        arrays = [array for named in run.arrays.values() for array in named.values()]
        arrays += [run.boxes] * 3 + list(run.details.values())  # 3: for all columns of our own
        size = sum(array.nbytes for array in arrays)
        if size <= self.free:
            self.free -= size
            self[key] = run
        return run


kept_runs: ContextVar[KeptRuns | None] = ContextVar("kept_runs", default=None)
"""Set by a command that reads each run once."""


def _run_file(run: Run, names: Mapping[str, str]) -> bytes:
    """A run as the sealed content of a Parquet file; `names` are its companions' by kind."""
    frames = np.concatenate(run.segments) if run.segments else np.arange(len(run.boxes))
    columns: dict[str, Any] = {"frame": frames.astype(np.int32)}
    columns |= dict(zip(BOX_COLUMNS, run.boxes.T, strict=True))
    columns |= {"visible": run.visible, "confidence": run.confidence}
    columns |= run.details
    metadata: dict[str, Any] = {
        "schema": SCHEMA,
        "identity": asdict(run.identity),
        "status": run.status,
        "failure": run.failure,
        "output": run.output,
        "details": list(run.details),
        "segmented": run.segmentation is not None,
        "companions": dict(names),
        "circumstances": {
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "host": socket.gethostname(),
            "platform": platform.platform(),
            "python": platform.python_version(),
            "libraries": _libraries(),
            **run.circumstances,
        },
    }
    if run.segmentation is not None:
        columns |= vars(run.segmentation)
    if run.states is not None:
        columns |= {"state": run.states.astype(np.int32)}
    if run.answered is not None:
        columns |= {"answered": run.answered.astype(np.int32)}
    if run.segments:
        lengths = [len(of) for of in run.segments]
        columns |= {"segment": np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)}
    if run.times is not None:
        columns |= {"wall_seconds": run.times.wall, "cpu_seconds": run.times.cpu}
        if run.times.warm_wall is not None and run.times.warm_cpu is not None:
            columns |= {"warm_wall_seconds": run.times.warm_wall}
            columns |= {"warm_cpu_seconds": run.times.warm_cpu}
        metadata["initialisation"] = [
            run.times.initialisation_wall,
            run.times.initialisation_cpu,
        ]
    table = as_columns(columns).replace_schema_metadata(
        {METADATA_KEY: json.dumps(metadata).encode(), SEAL_KEY: PLACEHOLDER.encode()}
    )
    sink = pa.BufferOutputStream()
    parquet.write_table(table, sink, compression="zstd")
    return sealed(sink.getvalue().to_pybytes())


@cache
def _libraries() -> dict[str, str]:
    """Versions of the libraries that pixels and boxes come from, by distribution."""
    return library_versions({"av", "cv2", "numba", "numpy", "scipy"})


def _run(path: Path, table: pa.Table, metadata: Mapping[str, Any]) -> Run:
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    segmentation = times = None
    if metadata.get("segmented"):  # older files do not say
        segmentation = Segmentation(columns["region_similarity"], columns["contour_accuracy"])
    if "initialisation" in metadata:
        warm = (columns.get(f"warm_{clock}_seconds") for clock in ("wall", "cpu"))  # lacking in old
        decoded = columns["wall_seconds"], columns["cpu_seconds"]
        times = Times(*decoded, *metadata["initialisation"], *warm)
    # In files of before these were reserved, a tracker's details may be called so.
    ours = {
        name: columns[name]
        for name in ("state", "answered", "segment")
        if name in columns and name not in metadata["details"]
    }
    segments: tuple[NDArray[Any], ...] = ()
    if "segment" in ours:
        borders = np.flatnonzero(np.diff(ours["segment"])) + 1
        segments = tuple(np.split(columns["frame"], borders))
    belonging = {
        kind: _companion(path, name) for kind, name in sorted(dict(metadata["companions"]).items())
    }
    revised = belonging.get("revised.arrow")
    arrays = belonging.get("arrays.npz")
    return Run(
        identity=_identity(metadata),
        boxes=_boxes(table),
        visible=columns["visible"],
        confidence=columns["confidence"],
        details={name: columns[name] for name in metadata["details"]},
        failure=metadata["failure"],
        revised=_boxes(arrow_table(revised)) if revised else None,
        arrays=_read_arrays(arrays) if arrays else {},
        segmentation=segmentation,
        times=times,
        states=ours.get("state"),
        answered=ours.get("answered"),
        segments=segments,
        circumstances=dict(metadata["circumstances"]),
        output=metadata["output"],
    )


def _identity(metadata: Mapping[str, Any]) -> Identity:
    """What determined a run. Anybody may have sealed it: the kinds are what all rely on.

    Raises `TypeError` where they are others.
    """
    identity = Identity(**metadata["identity"])
    circumstances = dict(metadata["circumstances"])
    told = vars(identity) | {"output": metadata["output"], "failure": metadata["failure"]}
    told |= {name: circumstances.get(name, "") for name in ("source", "truth")}
    kinds = dict.fromkeys(("parameters", "tracker_version"), dict) | {"repetition": int}
    for name, value in told.items():
        if type(value) is not kinds.get(name, str):
            raise TypeError(f"its {name} is {type(value).__name__}")
    for name in ("seconds", "frame_seconds", "update_seconds"):
        if not isinstance(circumstances.get(name), float | int | None):
            raise TypeError(f"its {name} are no number")
    return identity


def _boxes(table: pa.Table) -> NDArray[np.float64]:
    """Boxes of a run or of its companion, shape (n, 4)."""
    boxes = np.column_stack([table.column(name).to_numpy() for name in BOX_COLUMNS])
    boxes.flags.writeable = False  # as the other columns: runs may be shared, see `kept_runs`
    return boxes


def _companions(run: Run) -> dict[str, bytes]:
    """Sealed content of what belongs to a run, by kind: `revised.arrow`, `arrays.npz`."""
    found = {}
    if run.revised is not None:
        boxes = dict(zip(BOX_COLUMNS, run.revised.T, strict=True))
        found["revised.arrow"] = arrow_bytes(as_columns(boxes))
    if run.arrays:
        found["arrays.npz"] = _arrays_file(run.arrays)
    return found


def _digits(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def _companion(run: Path, name: str) -> bytes:
    """Sealed content of what belongs to a run, whose seal covers the name: it says which."""
    file = run.with_name(name)
    content = read_sealed(file)
    if f".{_digits(content)}." not in name:
        raise ResultsError(
            f"{file} is not what belongs to {run.name}: files were exchanged. Put back the right "
            "one, or remove the run (`trackmark results remove`) and run the same command again."
        )
    return content


def _read_arrays(content: bytes) -> dict[int, dict[str, NDArray[Any]]]:
    """Arrays and masks by frame and name."""
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        for key in archive.files:
            frame, _, name = key.partition("/")
            arrays.setdefault(int(frame), {})[name] = archive[key]
    return arrays


def _arrays_file(arrays: Mapping[int, Mapping[str, NDArray[Any]]]) -> bytes:
    flat = {
        f"{frame}/{name}": array for frame, named in arrays.items() for name, array in named.items()
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, **flat)  # type: ignore[arg-type]  # the stub mistakes ** for its flag
    with zipfile.ZipFile(stream, "a") as archive:
        archive.comment = PLACEHOLDER.encode()
    return sealed(stream.getvalue())
