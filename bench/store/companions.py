"""What belongs to a run and does not fit into its rows: revised boxes, arrays and masks.

Companions are named by their content, so that one can't be taken for another's: a run says
which are its own. They are written before it, and those that no run names any more are removed
after it.
"""

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.store.arrow_file import arrow_bytes, read_arrow
from bench.store.layout import BOX_COLUMNS
from bench.store.seal import PLACEHOLDER, read_sealed, sealed

__all__ = ["companion_name", "companions", "read_arrays", "read_boxes"]

_DIGITS = 16


def companions(run: Run) -> dict[str, bytes]:
    """Sealed content of what belongs to a run, by kind: `revised.arrow`, `arrays.npz`."""
    found = {}
    if run.revised is not None:
        found["revised.arrow"] = _boxes_file(run.revised)
    if run.arrays:
        found["arrays.npz"] = _arrays_file(run.arrays)
    return found


def companion_name(run: Path, kind: str, content: bytes) -> str:
    """File name of a run's companion."""
    return f"{run.stem}.{hashlib.sha256(content).hexdigest()[:_DIGITS]}.{kind}"


def read_boxes(file: Path) -> NDArray[np.float64]:
    """Revised boxes, (n, 4)."""
    table = read_arrow(file)
    return np.column_stack([table.column(name).to_numpy() for name in BOX_COLUMNS])


def read_arrays(file: Path) -> dict[int, dict[str, NDArray[Any]]]:
    """Arrays and masks by frame and name."""
    arrays: dict[int, dict[str, NDArray[Any]]] = {}
    with np.load(io.BytesIO(read_sealed(file)), allow_pickle=False) as archive:
        for key in archive.files:
            frame, _, name = key.partition("/")
            arrays.setdefault(int(frame), {})[name] = archive[key]
    return arrays


def _boxes_file(boxes: NDArray[Any]) -> bytes:
    table = pa.table(dict(zip(BOX_COLUMNS, np.ascontiguousarray(boxes.T), strict=True)))
    return arrow_bytes(table)


def _arrays_file(arrays: Mapping[int, Mapping[str, NDArray[Any]]]) -> bytes:
    flat = {
        f"{frame}/{name}": array for frame, named in arrays.items() for name, array in named.items()
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, **flat)  # type: ignore[arg-type]  # the stub mistakes ** for its flag
    with zipfile.ZipFile(stream, "a") as archive:
        archive.comment = PLACEHOLDER.encode()
    return sealed(stream.getvalue())
