"""Sequences of the Object Tracking Benchmark: `img/` and `groundtruth_rect.txt`.

Wu, Lim, Yang, "Object tracking benchmark", IEEE TPAMI 37(9), 2015. A row of the truth is
`x, y, width, height`, separated by commas, tabs or spaces; x and y count from 1.
"""

from pathlib import Path

import numpy as np

from datasets import truth_file
from datasets.image_files import image_files
from datasets.interface import Sequence, SequenceError
from datasets.number_files import columns, read_boxes
from datasets.recorded import recorded_images

__all__ = ["CITATION", "EXPECTS", "GENERAL", "read", "recognises"]

TRUTH, TLP_COLUMNS = "groundtruth_rect.txt", 6
EXPECTS = f"a folder with img/ and {TRUTH} (OTB)"
GENERAL = False
CITATION = "Wu, Lim, Yang, Object tracking benchmark, IEEE TPAMI 37(9), 2015"

# The one sequence of the benchmark whose truth begins later than its images.
IMAGES_BEFORE_TRUTH = {"david": 299}


def recognises(path: Path) -> bool:
    """Whether the folder holds `img/` and a `groundtruth_rect.txt`, be it of one of several.

    Rows of six numbers are those of TLP.
    """
    if not (path / "img").is_dir() or not any(path.glob("groundtruth_rect*.txt")):
        return False
    return not (path / TRUTH).is_file() or columns(path / TRUTH) != TLP_COLUMNS


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder; tags in its `attrs.txt` hold for the whole sequence."""
    name = path.resolve().name
    files = image_files(path / "img")
    if truth is None and not (path / TRUTH).is_file():
        there = sorted(file.name for file in path.glob("groundtruth_rect*.txt"))
        raise SequenceError(
            f"{path}: there is {', '.join(there[:3])}, a truth of one of several targets, but no "
            f"{TRUTH}. Copy the one that you want to {TRUTH}."
        )
    if truth is None:
        rows, source = truth_file.Truth(read_boxes(path / TRUTH, origin=1.0)), path / TRUTH
        skipped = IMAGES_BEFORE_TRUTH.get(name.lower(), 0)
        if len(files) >= skipped + len(rows.boxes):
            files = files[skipped:]
    else:
        rows, source = truth_file.read(truth), truth
    attrs = path / "attrs.txt"
    tags = truth_file.read_text(attrs).replace(",", " ").split() if attrs.exists() else []
    return recorded_images(
        name,
        files,
        rows,
        source,
        attributes={tag: np.ones(len(rows.boxes), dtype=np.bool_) for tag in tags},
    )
