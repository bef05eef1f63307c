"""Sequences of TLP (Track Long and Prosper): `img/` and a `groundtruth_rect.txt` of six columns.

A row of the ground truth is `frame,x,y,width,height,lost`. Frames count from 1; x and y are assumed
to count from 0, as nothing else is stated. A lost target is absent. Moudgil, Gandhi, "Long-term
visual object tracking benchmark", ACCV 2018.
"""

from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import as_boxes, count_columns, read_rows
from trackmark.datasets.truth_file import GroundTruth

TRUTH, N_COLUMNS = "groundtruth_rect.txt", 6
EXPECTS = f"a folder with img/ and a {TRUTH} of {N_COLUMNS} columns (TLP)"
MARKS = ("img/", TRUTH)
CITATION = "Moudgil, Gandhi, Long-term visual object tracking benchmark, ACCV 2018"


def recognises(path: Path) -> bool:
    """Return whether the folder has `img/` and a ground-truth file with six columns."""
    truth = path / TRUTH
    return (path / "img").is_dir() and truth.is_file() and count_columns(truth) == N_COLUMNS


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder."""
    name, images, source = path.resolve().name, numbered_images(path / "img", 1), path / TRUTH
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    rows = read_rows(
        source, {N_COLUMNS}, "six numbers, frame x y width height lost", "a row of TLP"
    )
    invalid = np.flatnonzero(
        (rows[:, 0] != np.arange(1, len(rows) + 1)) | ~np.isin(rows[:, 5], (0, 1))
    )
    if len(invalid):
        line = int(invalid[0])
        raise SequenceError(
            f"{source}: line {line + 1}: frame {rows[line, 0]:g}, lost {rows[line, 5]:g}. "
            f"Expected: frame {line + 1}, lost 0 or 1."
        )
    boxes = as_boxes(rows[:, 1:5], source)
    boxes[rows[:, 5] > 0] = np.nan
    return recorded_images(name, images, GroundTruth(boxes), source)
