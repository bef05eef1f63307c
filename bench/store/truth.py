"""The truth that runs were made with, kept beside them: reports open no sequence to score."""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark.bench.store.checksum import DamagedError, arrow_bytes, read_arrow, read_sealed
from trackmark.bench.store.columns import as_columns
from trackmark.bench.store.files import ResultsError, write_atomically
from trackmark.bench.store.layout import (
    BOX_COLUMNS,
    METADATA_KEY,
    SCHEMA,
    check_schema,
    folder_name,
)
from trackmark.datasets import Sequence, SequenceError
from trackmark.datasets.shapes import EncodedMask, Shapes

if TYPE_CHECKING:
    import pandas as pd

_OUTLINE = "shape/"
"""How the names of columns of polygons and masks begin."""


@dataclass(frozen=True)
class StoredTruth:
    """A sequence's truth as it was when runs were made; shapes as in `datasets.Sequence`."""

    name: str
    boxes: NDArray[Any]
    regions: Mapping[str, NDArray[Any]]
    visibility: NDArray[Any]
    attributes: Mapping[str, NDArray[Any]]
    fps: float | None
    image_size: tuple[int, int] | None = None
    shapes: Shapes | None = None


def truth_path(folder: Path, sequence: str, fingerprint: str) -> Path:
    """File that holds the truth of a sequence with this fingerprint."""
    # Encoded like a label: no text that stands in a file leads out of the folder.
    return folder / "_truth" / folder_name(sequence) / f"{folder_name(fingerprint[:32])}.arrow"


def write_truth(folder: Path, sequence: Sequence) -> None:
    """Keep a sequence's truth in an experiment's folder, unless it is there already.

    Raises `ResultsError` where it can't be written.
    """
    path = truth_path(folder, sequence.name, sequence.fingerprint)
    # What is damaged, or does not say its fingerprint, the images' size or outlines yet, is written
    # anew.
    with suppress(ResultsError, FileNotFoundError):
        there, fingerprint = check_truth(path)
        if fingerprint and there.image_size and (there.shapes or not sequence.shapes):
            return
    regions = {"boxes": sequence.boxes, **sequence.regions}
    columns: dict[str, Any] = {"visibility": sequence.visibility}
    for region, boxes in regions.items():
        for key, values in zip(BOX_COLUMNS, boxes.T, strict=True):
            columns[f"{region}/{key}"] = values
    for name, flags in sequence.attributes.items():
        columns[f"attribute/{name}"] = flags
    metadata = {
        "schema": SCHEMA,
        "name": sequence.name,
        "fingerprint": sequence.fingerprint,
        "fps": sequence.fps,
        "image_size": _image_size(sequence),
        "regions": list(regions),
        "attributes": list(sequence.attributes),
    }
    described = {METADATA_KEY: json.dumps(metadata).encode()}
    table = as_columns(columns)
    for kind, rows in _outlines(sequence.shapes).items():
        table = table.append_column(f"{_OUTLINE}{kind}", rows)
    write_atomically(path, arrow_bytes(table, described))


def _outlines(shapes: Shapes | None) -> dict[str, pa.Array]:
    """Polygons as their points' coordinates, masks as where they lie and their runs; else null."""
    stored = [] if shapes is None else shapes.as_stored()
    polygons = [one.ravel() if isinstance(one, np.ndarray) else None for one in stored]
    masks = [
        [one.x, one.y, one.width, one.height, *one.runs] if isinstance(one, EncodedMask) else None
        for one in stored
    ]
    columns = {
        "polygon": pa.array(polygons, pa.list_(pa.float64())),
        "mask": pa.array(masks, pa.list_(pa.int64())),
    }
    return {kind: rows for kind, rows in columns.items() if rows.null_count < len(rows)}


def _shapes_of(table: pa.Table, size: tuple[int, int] | None) -> Shapes | None:
    """What `_outlines` made; raises `ValueError` for what it would not make."""
    known: dict[int, NDArray[np.float64] | EncodedMask] = {}
    for name in filter(_is_outline, table.column_names):
        for frame, row in enumerate(table.column(name).to_pylist()):
            if row is not None and name == f"{_OUTLINE}polygon":
                known[frame] = np.array(row, np.float64).reshape(-1, 2)
            elif row is not None:
                x, y, width, height, *runs = row
                known[frame] = EncodedMask(x, y, width, height, np.array(runs, np.int64))
    return Shapes(known, range(len(table)), size or (0, 0)) if known else None


def _is_outline(column: str) -> bool:
    return column.startswith(_OUTLINE)


def _image_size(sequence: Sequence) -> tuple[int, int] | None:
    """Width and height of the images; None where the first can't be read, which runs will tell."""
    try:
        return sequence.image_size
    except SequenceError:
        return None


def occurring_attributes(folder: Path, runs: "pd.DataFrame") -> dict[str, set[str]]:
    """Attributes that occur in any frame, by sequence, of `runs` as `load_results` gives them.

    Raises `ResultsError` naming a file that is missing, damaged or not what its name says.
    """
    found: dict[str, set[str]] = {}
    for sequence, fingerprint in set(zip(runs["sequence"], runs["fingerprint"], strict=True)):
        attributes = read_truth(folder, sequence, fingerprint).attributes
        names = {name for name, flags in attributes.items() if flags.any()}
        found[sequence] = found.get(sequence, set()) | names
    return found


def copy_truth(source: Path, target: Path, sequence: str, fingerprint: str) -> None:
    """Copy a truth from one experiment's folder to another's, unless it is there already.

    Raises `ResultsError` naming a file that is missing, damaged or not what its name says.
    """
    there, copy = (truth_path(folder, sequence, fingerprint) for folder in (source, target))
    if not copy.is_file():
        read_truth(source, sequence, fingerprint)
        write_atomically(copy, read_sealed(there))


def check_truth(path: Path) -> tuple[StoredTruth, str]:
    """Read a file of truth, and the fingerprint that it says it has.

    It must be the truth that its place says, which its seal covers: its sequence, and its
    fingerprint. Files of trackmark before this was kept do not say their fingerprint ('' is given),
    and are known by their sequence alone.

    Raises `ResultsError` naming a file that is not what was written there, or can't be read now,
    and `FileNotFoundError`.
    """
    try:
        table = read_arrow(path)
        metadata: dict[str, Any] = json.loads(table.schema.metadata[METADATA_KEY])
        check_schema(path, metadata["schema"])
        name, fingerprint = metadata["name"], metadata.get("fingerprint", "")
        place = truth_path(path.parents[2], name, fingerprint)
        size = metadata.get("image_size")  # not kept by trackmark before there were presets for it
        columns = {
            column: table.column(column).to_numpy()
            for column in table.column_names
            if not _is_outline(column)
        }
        regions = {
            region: np.column_stack([columns[f"{region}/{key}"] for key in BOX_COLUMNS])
            for region in metadata["regions"]
        }
        found = StoredTruth(
            name=name,
            boxes=regions.pop("boxes"),
            regions=regions,
            visibility=columns["visibility"],
            attributes={key: columns[f"attribute/{key}"] for key in metadata["attributes"]},
            fps=metadata["fps"],
            image_size=tuple(size) if size else None,
            shapes=_shapes_of(table, size),
        )
    except ResultsError:
        raise
    except (pa.ArrowException, KeyError, TypeError, ValueError) as error:  # sealed by somebody
        raise DamagedError(f"{path} holds no truth: files were exchanged") from error
    if path.parent != place.parent or (fingerprint and path != place):
        raise DamagedError(f"{path} holds another truth, of {name}: files were exchanged")
    return found, fingerprint


def read_truth(folder: Path, sequence: str, fingerprint: str) -> StoredTruth:
    """Read the truth that runs on a sequence were made with.

    Raises `ResultsError` naming a file that is missing, damaged or not what its name says.
    """
    path = truth_path(folder, sequence, fingerprint)
    try:
        return check_truth(path)[0]
    except (OSError, DamagedError) as error:
        raise ResultsError(
            f"{path} is missing or damaged ({error}). Remove the runs on {sequence} "
            "(`trackmark results remove`) and run the same command again."
        ) from error
