"""Sequences of GOT-10k: a folder with images, `groundtruth.txt`, `meta_info.ini` and labels.

A row of the ground truth is `x,y,width,height`; x and y count from 1 (got-10k/toolkit#6). The
target is absent if `absence.label` is set, or if the size is not positive (got-10k/toolkit#10).
`cover.label` is an interval of the visible fraction, of which the centre is used. In test sets only
the first box is public: later frames are not annotated and not scored. Huang, Zhao, Huang,
"GOT-10k: a large high-diversity benchmark for generic object tracking in the wild", IEEE TPAMI
43(5), 2021.
"""

from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import (
    check_row_count,
    field_fps,
    frames_with_values,
    read_boxes,
    read_fields,
    read_flags,
    read_integers,
)
from trackmark.datasets.truth_file import GroundTruth

TRUTH, FIELDS, COVER = "groundtruth.txt", "meta_info.ini", "cover.label"
FLAGS = ("absence", "cut_by_image")
EXPECTS = f"a folder of images with {TRUTH} and {FIELDS} or {COVER} (GOT-10k)"
MARKS = (TRUTH, FIELDS, COVER, *(f"{flag}.label" for flag in FLAGS))
FLAG_FILES = (COVER, *(f"{flag}.label" for flag in FLAGS))
FIRST_PIXEL = 1
CITATION = (
    "Huang, Zhao, Huang, GOT-10k: a large high-diversity benchmark for generic object tracking in "
    "the wild, IEEE TPAMI 43(5), 2021"
)

# Visible fraction by label, the centre of an interval: 0, (0, 15] %, (15, 30], (30, 45],
# (45, 60], (60, 75], (75, 90], (90, 100), and 100 %.
_VISIBILITY = np.array([0.0, 0.075, 0.225, 0.375, 0.525, 0.675, 0.825, 0.95, 1.0])


def recognises(path: Path) -> bool:
    """Return whether the folder has a ground truth, and a file or name that only GOT-10k has."""
    is_named = path.resolve().name.startswith("GOT-10k_")
    is_marked = is_named or any((path / mark).is_file() for mark in MARKS[1:])
    # The reader of image folders opens a folder with a `truth.csv`.
    return (path / TRUTH).is_file() and is_marked and not (path / "truth.csv").is_file()


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder; the labels `absence` and `cut_by_image` are attributes."""
    name, images, source = path.resolve().name, numbered_images(path, 1), path / TRUTH
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=FIRST_PIXEL, zero_is_absent=False)
    check_row_count(len(boxes), images, source)
    n = frames_with_values(len(boxes), images)
    flags = read_flags([path / f"{flag}.label" for flag in FLAGS], n)
    if "absence" in flags:
        boxes[flags["absence"][: len(boxes)]] = np.nan
    cover = path / COVER
    visibility = _VISIBILITY[read_integers(cover, n, 8)] if cover.is_file() else None
    fields = read_fields(path / FIELDS) if (path / FIELDS).is_file() else {}
    classes = [fields.get(key, "") for key in ("object_class", "motion_class")]
    return recorded_images(
        name,
        images,
        GroundTruth(boxes, visibility),
        source,
        attributes=flags,
        fps=field_fps(fields, "anno_fps", path / FIELDS),
        description=", ".join(filter(None, classes)),
    )
