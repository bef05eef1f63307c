"""Sequences of LaSOT: `img/`, `groundtruth.txt`, and files with flags and a description.

A row of the ground truth is `x,y,width,height`; x and y count from 1 (LaSOT_Evaluation_Toolkit#14).
The target is absent if `full_occlusion.txt` or `out_of_view.txt` is set. Fan et al.,
"LaSOT: a high-quality benchmark for large-scale single object tracking", CVPR 2019.
"""

from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import (
    check_row_count,
    frames_with_values,
    read_boxes,
    read_flags,
)
from trackmark.datasets.truth_file import GroundTruth

TRUTH, FLAGS = "groundtruth.txt", ("full_occlusion", "out_of_view")
EXPECTS = f"a folder with img/ and {TRUTH} (LaSOT)"
MARKS = ("img/", TRUTH, *(f"{flag}.txt" for flag in FLAGS))
FIRST_PIXEL = 1
CITATION = (
    "Fan et al., LaSOT: a high-quality benchmark for large-scale single object tracking, CVPR 2019"
)
FLAG_FILES = tuple(f"{flag}.txt" for flag in FLAGS)
LICENCE = "for research only (stated by its authors in HengLan/LaSOT_Evaluation_Toolkit#25)"


def recognises(path: Path) -> bool:
    """Return whether the folder has `img/` and `groundtruth.txt`, but no file of OTB."""
    has_files = (path / "img").is_dir() and (path / TRUTH).is_file()
    return has_files and not any(path.glob("groundtruth_rect*.txt"))


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder; the flags are attributes, the text of `nlp.txt` is the description."""
    name, images, source = path.resolve().name, numbered_images(path / "img", 1), path / TRUTH
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=FIRST_PIXEL, zero_is_absent=False)
    check_row_count(len(boxes), images, source)
    n = frames_with_values(len(boxes), images)
    flags = read_flags([path / f"{flag}.txt" for flag in FLAGS], n)
    for absent in flags.values():
        boxes[absent[: len(boxes)]] = np.nan
    description_file = path / "nlp.txt"
    return recorded_images(
        name,
        images,
        GroundTruth(boxes),
        source,
        attributes=flags,
        description=" ".join(truth_file.read_text(description_file).split())
        if description_file.is_file()
        else "",
    )
