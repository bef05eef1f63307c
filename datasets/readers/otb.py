"""Sequences of the Object Tracking Benchmark: `img/` and `groundtruth_rect.txt`.

Wu, Lim, Yang, "Object tracking benchmark", IEEE TPAMI 37(9), 2015. A row of the truth is
`x, y, width, height`, separated by commas, tabs or spaces; x and y count from 1.
"""

from math import isinf, nan
from pathlib import Path

import numpy as np

from datasets import truth_file
from datasets.decoding import brief
from datasets.image_files import ImageFiles, image_files
from datasets.interface import Sequence, SequenceError
from datasets.recorded import recorded

__all__ = ["EXPECTS", "GENERAL", "read", "recognises"]

TRUTH = "groundtruth_rect.txt"
EXPECTS = f"a folder with img/ and {TRUTH} (OTB)"
GENERAL = False

# The one sequence of the benchmark whose truth begins later than its images.
IMAGES_BEFORE_TRUTH = {"david": 299}


def recognises(path: Path) -> bool:
    """Whether the folder holds `img/` and a `groundtruth_rect.txt`, be it of one of several."""
    return (path / "img").is_dir() and any(path.glob("groundtruth_rect*.txt"))


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
        rows, source = _truth(path / TRUTH), path / TRUTH
        skipped = IMAGES_BEFORE_TRUTH.get(name.lower(), 0)
        if len(files) >= skipped + len(rows.boxes):
            files = files[skipped:]
    else:
        rows, source = truth_file.read(truth), truth
    attrs = path / "attrs.txt"
    tags = truth_file.read_text(attrs).replace(",", " ").split() if attrs.exists() else []
    return recorded(
        name,
        ImageFiles(files),
        files,
        rows,
        source,
        frame_names=[file.name for file in files],
        attributes={tag: np.ones(len(rows.boxes), dtype=np.bool_) for tag in tags},
    )


def _truth(path: Path) -> truth_file.Truth:
    """Boxes from 0; NaN rows where the target is absent.

    A row without size says that the target is absent, but not in the first row: there it is
    a mistake, which is kept for `Sequence.check_runnable` to refuse.
    """
    lines = truth_file.read_text(path).rstrip().splitlines()
    boxes = np.array([_box(line, path, number) for number, line in enumerate(lines, 1)])
    if len(boxes) == 0:
        raise SequenceError(f"{path}: there are no rows.")
    boxes[:, :2] -= 1.0
    absent = np.isnan(boxes).any(axis=1)
    absent[1:] |= (boxes[1:, 2:] == 0.0).any(axis=1)
    boxes[absent] = nan
    negative = 1 + np.flatnonzero((boxes[1:, 2:] < 0.0).any(axis=1))
    if len(negative):
        raise SequenceError(f"{path}: line {negative[0] + 1}: the box has a negative size.")
    return truth_file.Truth(boxes)


def _box(line: str, path: Path, number: int) -> list[float]:
    try:
        box = [float(value) for value in line.replace(",", " ").split()]
    except ValueError:
        box = []
    if len(box) != 4 or any(isinf(value) for value in box):
        raise SequenceError(
            f"{path}: line {number}: {brief(line.strip())} is not a box; expected are four "
            "numbers, x y width height."
        )
    return box
