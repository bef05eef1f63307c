"""Conversion of results of older versions of trackmark, with one Parquet file per run.

```
<experiment>/plan.json                                          requested runs
             <tracker>/<sequence>/<repetition>.parquet          run
                                  <repetition>.<digest>.…       its revised boxes and arrays
             _truth/<sequence>/<fingerprint>.arrow              ground truth
             _log/<start>.jsonl                                 log of a command, not converted
```

Each file contains the digest of its content.
"""

import hashlib
import io
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.metrics.regions import Segmentation
from trackmark.bench.metrics.times import Times
from trackmark.bench.store.database import DamagedError
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE, RunKey
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, store_truth
from trackmark.datasets.shapes import EncodedMask, Shapes
from trackmark.reports.temporary_paths import temporary_folder

if TYPE_CHECKING:
    import pyarrow as pa

_SCHEMA = 2
_MARK = b"trackmark-sha256:"
_KEY = b"trackmark"
_BOX = ("x", "y", "width", "height")
_BATCH = 200  # runs that are written in one transaction


def convert_results(folder: Path, progress: Callable[[int, int], None] = lambda *_: None) -> int:
    """Convert the Parquet files in an experiment's folder to a new results file.

    `progress` is called with the number of converted runs and the number of all runs. Returns the
    number of runs.

    Raises `ResultsError`, without changes of the folder, if it has no Parquet results, if it
    already has the new file, if a file is damaged, or if pyarrow is missing.
    """
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise ResultsError(
            "Converting Parquet files needs pyarrow: `pip install 'trackmark[parquet]'`."
        ) from error
    if not (folder / "plan.json").is_file():
        raise ResultsError(f"{folder} has no plan.json, so it has no results of older versions.")
    if (folder / DATABASE).exists():
        raise ResultsError(
            f"{folder / DATABASE} already exists. Remove it to convert the results again."
        )
    with temporary_folder(folder, ".convert-") as temporary:
        number = _convert(folder, temporary, progress)
        (temporary / DATABASE).replace(folder / DATABASE)
    return number


def _convert(folder: Path, target: Path, progress: Callable[[int, int], None]) -> int:
    files = sorted(folder.glob("[!_.]*/*/*.parquet"))
    results = Results(target)
    results.prepare(_read_manifest(folder / "plan.json"))
    truths: set[tuple[str, str]] = set()
    for begin in range(0, len(files), _BATCH):
        runs = [_read_run(file) for file in files[begin : begin + _BATCH]]
        for key in {(run.identity.sequence, run.identity.fingerprint) for run in runs} - truths:
            truths.add(key)
            name = _folder_name(key[1][:32])
            file = folder / "_truth" / _folder_name(key[0]) / f"{name}.arrow"
            store_truth(target, key[1], _read_truth(file, key[0]))
        results.write_all((run, "") for run in runs)
        progress(begin + len(runs), len(files))
    return len(files)


def _read_verified(path: Path) -> bytes:
    """Return the content of a file; raise `DamagedError` if its digest does not match."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ResultsError(f"{path} cannot be read: {error.strerror}.") from error
    for stored in set(re.findall(re.escape(_MARK) + b"[0-9a-f]{64}", content)):
        blank = content.replace(stored, _MARK + b"0" * 64)
        if stored == _MARK + hashlib.sha256(blank).hexdigest().encode():
            return content
    raise DamagedError(
        f"{path} is damaged: its digest does not match. Remove the file and try again."
    )


def _read_metadata(path: Path, table: "pa.Table") -> dict[str, Any]:
    metadata: dict[str, Any] = json.loads(table.schema.metadata[_KEY])
    _check_schema(path, metadata["schema"])
    return metadata


def _check_schema(path: Path, schema: object) -> None:
    if schema != _SCHEMA:
        raise ResultsError(
            f"{path} has the layout version {schema}; expected {_SCHEMA}. Run again instead."
        )


def _read_manifest(path: Path) -> Manifest:
    plan = json.loads(_read_verified(path))
    _check_schema(path, plan["schema"])
    names, series = plan["names"], plan["series"]
    keys = ("tracker", "sequence", "protocol", "version", "first", "count")
    versions: dict[RunKey, str] = {}
    for numbers in zip(*(series[key] for key in keys), strict=True):
        tracker, sequence, protocol, version = (
            names[key][number] for key, number in zip(keys[:4], numbers[:4], strict=True)
        )
        first, count = numbers[4:]
        versions |= {(tracker, sequence, first + i, protocol): version for i in range(count)}
    return Manifest(plan["title"], versions)


def _read_run(path: Path) -> Run:
    import pyarrow as pa
    from pyarrow import feather, parquet

    table = parquet.ParquetFile(pa.BufferReader(_read_verified(path))).read(use_threads=False)
    metadata = _read_metadata(path, table)
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    companions = {
        kind: _read_verified(path.with_name(name)) for kind, name in metadata["companions"].items()
    }
    segmentation = times = revised = None
    if metadata.get("segmented"):
        segmentation = Segmentation(columns["region_similarity"], columns["contour_accuracy"])
    if "initialisation" in metadata:
        warm = (columns.get(f"warm_{clock}_seconds") for clock in ("wall", "cpu"))
        decoded = columns["wall_seconds"], columns["cpu_seconds"]
        times = Times(*decoded, *metadata["initialisation"], *warm)
    harness_columns = {
        name: columns[name]
        for name in ("state", "answered", "segment")
        if name in columns and name not in metadata["details"]
    }
    segments: tuple[NDArray[Any], ...] = ()
    if "segment" in harness_columns:
        borders = np.flatnonzero(np.diff(harness_columns["segment"])) + 1
        segments = tuple(np.split(columns["frame"], borders))
    if "revised.arrow" in companions:
        revised = _boxes(feather.read_table(pa.BufferReader(companions["revised.arrow"])), "")
    return Run(
        identity=Identity(**metadata["identity"]),
        boxes=_boxes(table, ""),
        visible=columns["visible"],
        confidence=columns["confidence"],
        details={name: columns[name] for name in metadata["details"]},
        failure=metadata["failure"],
        revised=revised,
        arrays=_arrays(companions["arrays.npz"]) if "arrays.npz" in companions else {},
        segmentation=segmentation,
        times=times,
        states=harness_columns.get("state"),
        source_frames=harness_columns.get("answered"),
        segments=segments,
        circumstances=metadata["circumstances"],
        output=metadata["output"],
    )


def _read_truth(path: Path, sequence: str) -> StoredTruth:
    import pyarrow as pa
    from pyarrow import feather

    table = feather.read_table(pa.BufferReader(_read_verified(path)))
    metadata = _read_metadata(path, table)
    if metadata["name"] != sequence:
        raise DamagedError(
            f"{path} contains the ground truth of {metadata['name']}, not of {sequence}. Restore "
            "the file from a backup."
        )
    size = metadata.get("image_size")
    return StoredTruth(
        name=sequence,
        boxes=_boxes(table, "boxes/"),
        regions={
            name: _boxes(table, f"{name}/") for name in metadata["regions"] if name != "boxes"
        },
        visibility=table.column("visibility").to_numpy(),
        attributes={
            name: table.column(f"attribute/{name}").to_numpy() for name in metadata["attributes"]
        },
        fps=metadata["fps"],
        image_size=tuple(size) if size else None,
        shapes=_shapes(table, size),
    )


def _shapes(table: "pa.Table", size: tuple[int, int] | None) -> Shapes | None:
    shapes: dict[int, NDArray[np.float64] | EncodedMask] = {}
    for kind in ("polygon", "mask"):
        rows = (
            table.column(f"shape/{kind}").to_pylist()
            if f"shape/{kind}" in table.schema.names
            else []
        )
        for frame, row in enumerate(rows):
            if row is not None and kind == "polygon":
                shapes[frame] = np.array(row, np.float64).reshape(-1, 2)
            elif row is not None:
                x, y, width, height, *runs = row
                shapes[frame] = EncodedMask(x, y, width, height, np.array(runs, np.int64))
    return Shapes(shapes, range(len(table)), size or (0, 0)) if shapes else None


def _boxes(table: "pa.Table", prefix: str) -> NDArray[np.float64]:
    return np.column_stack([table.column(f"{prefix}{name}").to_numpy() for name in _BOX])


def _arrays(content: bytes) -> dict[int, dict[str, NDArray[Any]]]:
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        for key in archive.files:
            frame, _, name = key.partition("/")
            arrays.setdefault(int(frame), {})[name] = archive[key]
    return arrays


def _folder_name(label: str) -> str:
    """Return the name of a sequence's folder, or of a fingerprint's file without the suffix."""
    name = quote(label, safe="=")
    if name[:1] in ("_", "."):
        name = f"%{ord(name[0]):02X}{name[1:]}"
    if len(name) <= 200:
        return name
    return f"{name[:183]}~{hashlib.sha256(label.encode()).hexdigest()[:16]}"
