"""Sequences of GOT-10k: images with `groundtruth.txt`, `meta_info.ini` and labels beside them.

A row of the truth is `x,y,width,height`; x and y count from 1 (got-10k/toolkit#6). A frame is
without target where `absence.label` says so, or where the size is not positive (#10 there).
`cover.label` gives the visible share in eighths of no equal size, of which the middle is taken. Of
test sets only the first box is public: the frames behind it have no truth and are not scored.
Huang, Zhao, Huang, "GOT-10k: a large high-diversity benchmark for generic object tracking in the
wild", IEEE TPAMI 43(5), 2021.
"""

from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import (
    check_row_count,
    fps_of,
    read_boxes,
    read_fields,
    read_flags,
    without_rest,
)
from trackmark.datasets.recorded import recorded_images

TRUTH, FIELDS, COVER = "groundtruth.txt", "meta_info.ini", "cover.label"
FLAGS = ("absence", "cut_by_image")
EXPECTS = f"a folder of images with {TRUTH} and {FIELDS} or {COVER} (GOT-10k)"
GENERAL = False
MARKS = (TRUTH, FIELDS, COVER, *(f"{flag}.label" for flag in FLAGS))
CITATION = (
    "Huang, Zhao, Huang, GOT-10k: a large high-diversity benchmark for generic object tracking in "
    "the wild, IEEE TPAMI 43(5), 2021"
)

# Middles of 0, (0, 15] %, (15, 30], (30, 45], (45, 60], (60, 75], (75, 90], (90, 100), and 100 %.
_VISIBLE = np.array([0.0, 0.075, 0.225, 0.375, 0.525, 0.675, 0.825, 0.95, 1.0])


def recognises(path: Path) -> bool:
    """Whether the folder holds a truth and what only this benchmark has beside it."""
    beside = (FIELDS, COVER, *(f"{flag}.label" for flag in FLAGS))
    marks = any((path / mark).is_file() for mark in beside)
    named = path.resolve().name.startswith("GOT-10k_")
    own = (path / "truth.csv").is_file()  # makes it a folder of images
    return (path / TRUTH).is_file() and (marks or named) and not own


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder; the labels `absence` and `cut_by_image` are attributes."""
    name, images, source = path.resolve().name, numbered_images(path, 1), path / TRUTH
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    boxes = without_rest(read_boxes(source, origin=1.0, minus_is_absent=True), len(images))
    check_row_count(len(boxes), images, source)
    files = {flag: path / f"{flag}.label" for flag in FLAGS}
    flags = {
        flag: read_flags(file, len(boxes)) > 0 for flag, file in files.items() if file.is_file()
    }
    if "absence" in flags:
        boxes[flags["absence"]] = np.nan
    cover = path / COVER
    visible = _VISIBLE[read_flags(cover, len(boxes), most=8)] if cover.is_file() else None
    fields = read_fields(path / FIELDS) if (path / FIELDS).is_file() else {}
    said = [fields.get(key, "") for key in ("object_class", "motion_class")]
    return recorded_images(
        name,
        images,
        truth_file.GroundTruth(boxes, visible),
        source,
        attributes=flags,
        fps=fps_of(fields, "anno_fps", path / FIELDS),
        description=", ".join(word for word in said if word),
    )
