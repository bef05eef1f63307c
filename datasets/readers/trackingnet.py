"""Sequences of TrackingNet: `SET/frames/NAME/` and `SET/anno/NAME.txt`.

A row of the ground truth is `x,y,width,height`, assumed to count from 0, as nothing else is stated.
In the set TEST only the first box is public: later frames are not annotated and not scored.
Müller et al., "TrackingNet: a large-scale dataset and benchmark for object tracking in the wild",
ECCV 2018.
"""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import check_row_count, read_boxes
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import GroundTruth

IMAGES, TRUTHS = "frames", "anno"
EXPECTS = f"a folder {IMAGES}/NAME with {TRUTHS}/NAME.txt (TrackingNet)"
CITATION = (
    "Müller et al., TrackingNet: a large-scale dataset and benchmark for object tracking in the "
    "wild, ECCV 2018"
)


def recognises(path: Path) -> bool:
    """Return whether the path is an image folder, or `SET/NAME` for the sequence `NAME`."""
    return _locate(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Return the sequences of a set (`TEST`, `TRAIN_0`, …); see `ReaderOfMany`."""
    if not ((folder / TRUTHS).is_dir() and (folder / IMAGES).is_dir()):
        return []
    names = {file.stem for file in (folder / TRUTHS).glob("*.txt")}
    names |= {entry.name for entry in (folder / IMAGES).iterdir() if entry.is_dir()}
    return [folder / IMAGES / name for name in sorted(names, key=natural_order)]


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the sequence."""
    location = _locate(path)
    assert location is not None  # `recognises` is true
    images, source = numbered_images(location[0], 0), location[1]
    if truth is not None:
        return recorded_images(source.stem, images, truth_file.read(truth), truth)
    boxes = read_boxes(source)
    check_row_count(len(boxes), images, source)
    return recorded_images(source.stem, images, GroundTruth(boxes), source)


def _locate(path: Path) -> tuple[Path, Path] | None:
    """Return a sequence's image folder and ground-truth file; None for another format."""
    full = path.resolve()
    root = full.parents[1] if full.parent.name == IMAGES else full.parent
    images, truth = root / IMAGES / full.name, root / TRUTHS / f"{full.name}.txt"
    # The reader of image folders opens a folder with a `truth.csv`.
    is_complete = images.is_dir() and truth.is_file() and not (images / "truth.csv").is_file()
    return (images, truth) if is_complete else None
