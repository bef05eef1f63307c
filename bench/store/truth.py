"""Stored ground truth of the runs of an experiment; scoring needs no access to sequences."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from sqlite3 import Row
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.store.database import (
    DamagedError,
    Database,
    ResultsError,
    open_database,
    pack,
    select_group,
    unpack,
)
from trackmark.datasets import Sequence, SequenceError

if TYPE_CHECKING:
    from trackmark.datasets.shapes import Shapes

_KEY = "sequence = ? AND fingerprint = ?"


@dataclass(frozen=True)
class StoredTruth:
    """Ground truth of a sequence at the time of its runs; fields as in `Sequence`."""

    name: str
    fingerprint: str
    boxes: NDArray[Any]
    regions: Mapping[str, NDArray[Any]]
    visibility: NDArray[Any]
    attributes: Mapping[str, NDArray[Any]]
    fps: float | None
    image_size: tuple[int, int] | None = None
    shapes: "Shapes | None" = None
    # (n,): see `Sequence`; shape () for all frames
    annotated: NDArray[np.bool_] = field(default_factory=lambda: np.array(True))
    # (n,): see `Sequence`; shape () for no frame
    malformed: NDArray[np.bool_] = field(default_factory=lambda: np.array(False))
    first_pixel: int = 0  # coordinate of the first pixel in the files of the data set


def stored_truth(sequence: Sequence) -> StoredTruth:
    """Return the ground truth of a sequence as it is stored."""
    try:
        image_size = sequence.image_size
    except SequenceError:  # the first image is unreadable, so that runs fail
        image_size = None
    return StoredTruth(
        sequence.name,
        sequence.fingerprint,
        sequence.boxes,
        sequence.regions,
        sequence.visibility,
        sequence.attributes,
        sequence.fps,
        image_size,
        sequence.shapes,
        sequence.annotated,
        sequence.malformed,
        sequence.origin.first_pixel,
    )


def put_truth(database: Database, truth: StoredTruth) -> None:
    """Store a ground truth in a transaction, unless it is stored already and undamaged.

    Raises `ResultsError` if other boxes are stored under the same name and fingerprint.
    """
    key = truth.name, truth.fingerprint
    # A damaged ground truth is replaced.
    for row in database.rows("truth", _KEY, *key, on_damage=lambda _: None):
        if not np.array_equal(unpack(row["arrays"])["boxes"].T, truth.boxes, equal_nan=True):
            raise ResultsError(
                f"{database.path} has another ground truth of {truth.name} with the same "
                f"fingerprint {truth.fingerprint}. Give each sequence its own fingerprint."
            )
        return
    database.insert("truth", [(*key, _packed(truth))])


def read_truth(folder: Path, sequence: str, fingerprint: str) -> StoredTruth:
    """Return the ground truth of runs on a sequence.

    Raises `ResultsError`, which names the file, if the ground truth is missing or damaged.
    """
    with open_database(folder) as database:
        for row in database.rows("truth", _KEY, sequence, fingerprint):
            return truth_of_row(row)
    raise DamagedError(missing_truth(database.path, sequence, fingerprint))


def missing_truth(file: Path, sequence: str, fingerprint: str) -> str:
    """Return the message for runs whose ground truth is not stored in `file`, the database."""
    return (
        f"{file} has no ground truth of {sequence} with the fingerprint {fingerprint}. Remove "
        f"the runs on {sequence} (`trackmark results remove`) and run the same command again."
    )


def _packed(truth: StoredTruth) -> bytes:
    """Return the arrays of a ground truth as they are stored."""
    arrays = {"boxes": truth.boxes.T, "visibility": truth.visibility}
    arrays |= {f"region/{name}": boxes.T for name, boxes in truth.regions.items()}
    arrays |= {f"attribute/{name}": flags for name, flags in truth.attributes.items()}
    if not truth.annotated.all():
        arrays["annotated"] = truth.annotated
    if truth.malformed.any():
        arrays["malformed"] = truth.malformed
    if truth.fps is not None:
        arrays["fps"] = np.array(truth.fps, np.float64)
    arrays["first_pixel"] = np.array(truth.first_pixel, np.int64)
    if truth.image_size is not None:
        arrays["image_size"] = np.array(truth.image_size, np.int64)
    for frame, shape in enumerate(truth.shapes.as_stored() if truth.shapes else ()):
        if isinstance(shape, np.ndarray):
            arrays[f"polygon/{frame}"] = shape
        elif shape is not None:
            bounds = [shape.x, shape.y, shape.width, shape.height]
            arrays[f"mask/{frame}"] = np.array([*bounds, *shape.runs], np.int64)
    return pack(arrays)


def truth_of_row(row: Row) -> StoredTruth:
    """Return the ground truth in a row of the table `truth`."""
    arrays = unpack(row["arrays"])
    size: Any = tuple(arrays["image_size"].tolist()) if "image_size" in arrays else None
    n = len(arrays["visibility"])
    return StoredTruth(
        row["sequence"],
        row["fingerprint"],
        boxes=arrays["boxes"].T,
        regions={key: boxes.T for key, boxes in select_group(arrays, "region").items()},
        visibility=arrays["visibility"],
        attributes=select_group(arrays, "attribute"),
        fps=float(arrays["fps"]) if "fps" in arrays else None,
        image_size=size,
        shapes=_shapes(arrays, n, size or (0, 0)),
        annotated=arrays.get("annotated", np.ones(n, np.bool_)),
        malformed=arrays.get("malformed", np.zeros(n, np.bool_)),
        first_pixel=int(arrays["first_pixel"]),
    )


def _shapes(arrays: Mapping[str, NDArray[Any]], n: int, size: tuple[int, int]) -> "Shapes | None":
    """Return the polygons and masks of n frames of this size; None if there are none."""
    polygons, masks = select_group(arrays, "polygon"), select_group(arrays, "mask")
    if not (polygons or masks):
        return None
    from trackmark.datasets.shapes import EncodedMask, Shapes

    shapes: dict[int, NDArray[np.float64] | EncodedMask] = {}
    for frame, polygon in polygons.items():
        shapes[int(frame)] = polygon
    for frame, (x, y, width, height, *runs) in masks.items():
        bounds = (int(x), int(y), int(width), int(height))
        shapes[int(frame)] = EncodedMask(*bounds, np.array(runs, np.int64))
    return Shapes(shapes, range(n), size)
