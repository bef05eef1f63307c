"""Sequences of LaSOT: `img/`, `groundtruth.txt`, and beside them flags and a sentence.

A row of the truth is `x,y,width,height`; x and y count from 1 (LaSOT_Evaluation_Toolkit#14). Where
`full_occlusion.txt` or `out_of_view.txt` says so, the target is absent. Fan et al.,
"LaSOT: a high-quality benchmark for large-scale single object tracking", CVPR 2019.
"""

from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import check_row_count, read_boxes, read_flags
from trackmark.datasets.recorded import recorded_images

TRUTH, FLAGS = "groundtruth.txt", ("full_occlusion", "out_of_view")
EXPECTS = f"a folder with img/ and {TRUTH} (LaSOT)"
GENERAL = False
MARKS = ("img/", TRUTH, *(f"{flag}.txt" for flag in FLAGS))
CITATION = (
    "Fan et al., LaSOT: a high-quality benchmark for large-scale single object tracking, CVPR 2019"
)
LICENCE = "for research only (its authors, HengLan/LaSOT_Evaluation_Toolkit#25)"


def recognises(path: Path) -> bool:
    """Whether the folder holds `img/` and `groundtruth.txt`, but none of OTB's truths."""
    there = (path / "img").is_dir() and (path / TRUTH).is_file()
    return there and not any(path.glob("groundtruth_rect*.txt"))


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the folder; the two flags are attributes, the sentence in `nlp.txt` its description."""
    name, images, source = path.resolve().name, numbered_images(path / "img", 1), path / TRUTH
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=1.0)
    check_row_count(len(boxes), images, source)
    files = {flag: path / f"{flag}.txt" for flag in FLAGS}
    flags = {
        flag: read_flags(file, len(boxes)) > 0 for flag, file in files.items() if file.is_file()
    }
    for absent in flags.values():
        boxes[absent] = np.nan
    said = path / "nlp.txt"
    return recorded_images(
        name,
        images,
        truth_file.GroundTruth(boxes),
        source,
        attributes=flags,
        description=" ".join(truth_file.read_text(said).split()) if said.is_file() else "",
    )
