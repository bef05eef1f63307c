"""The truth that runs were made with, kept beside them: reports open no sequence to score."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from bench.store.checksum import DamagedError, arrow_bytes, read_arrow
from bench.store.columns import as_columns
from bench.store.files import ResultsError, write_atomically
from bench.store.layout import BOX_COLUMNS, METADATA_KEY, SCHEMA, check_schema, folder_name
from datasets import Sequence

__all__ = ["StoredTruth", "read_truth", "truth_path", "write_truth"]


@dataclass(frozen=True)
class StoredTruth:
    """A sequence's truth as it was when runs were made; shapes as in `datasets.Sequence`."""

    name: str
    boxes: NDArray[Any]
    regions: Mapping[str, NDArray[Any]]
    visibility: NDArray[Any]
    attributes: Mapping[str, NDArray[Any]]
    fps: float | None


def truth_path(folder: Path, sequence: str, fingerprint: str) -> Path:
    """File that holds the truth of a sequence with this fingerprint."""
    return folder / "_truth" / folder_name(sequence) / f"{fingerprint[:32]}.arrow"


def write_truth(folder: Path, sequence: Sequence) -> None:
    """Keep a sequence's truth in an experiment's folder, unless it is there already.

    Raises `ResultsError` where it can't be written.
    """
    path = truth_path(folder, sequence.name, sequence.fingerprint)
    if path.is_file():
        try:
            read_truth(folder, sequence.name, sequence.fingerprint)
        except ResultsError:
            pass  # damaged: it is written anew
        else:
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
        "fps": sequence.fps,
        "regions": list(regions),
        "attributes": list(sequence.attributes),
    }
    described = {METADATA_KEY: json.dumps(metadata).encode()}
    write_atomically(path, arrow_bytes(as_columns(columns), described))


def read_truth(folder: Path, sequence: str, fingerprint: str) -> StoredTruth:
    """Read the truth that runs on a sequence were made with.

    Raises `ResultsError` naming a file that is missing or damaged.
    """
    path = truth_path(folder, sequence, fingerprint)
    try:
        table = read_arrow(path)
        metadata = json.loads(table.schema.metadata[METADATA_KEY])
        check_schema(path, metadata["schema"])
        columns = {name: table.column(name).to_numpy() for name in table.column_names}
        regions = {
            region: np.column_stack([columns[f"{region}/{key}"] for key in BOX_COLUMNS])
            for region in metadata["regions"]
        }
    except (OSError, DamagedError, pa.ArrowException, KeyError, TypeError) as error:
        raise ResultsError(
            f"{path} is missing or damaged ({error}). Remove the runs on {sequence} "
            "(`trackmark results remove`) and run the same command again."
        ) from error
    return StoredTruth(
        name=metadata["name"],
        boxes=regions.pop("boxes"),
        regions=regions,
        visibility=columns["visibility"],
        attributes={name: columns[f"attribute/{name}"] for name in metadata["attributes"]},
        fps=metadata["fps"],
    )
