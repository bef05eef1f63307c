"""Sequences of the Object Tracking Benchmark: `img/` and `groundtruth_rect.txt`.

Wu, Lim, Yang, "Object tracking benchmark", IEEE TPAMI 37(9), 2015. A row of the ground truth is
`x, y, width, height`, separated by commas, tabs or spaces; x and y count from 1. A folder with
`groundtruth_rect.1.txt` and `groundtruth_rect.2.txt` contains two sequences, Jogging.1 and
Jogging.2; some toolkits call them Jogging-1 or Jogging_1.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import (
    as_boxes,
    check_row_count,
    count_columns,
    frames_with_values,
    read_rows,
)
from trackmark.datasets.recorded import Choice, recorded
from trackmark.datasets.truth_file import GroundTruth

TRUTH, N_TLP_COLUMNS = "groundtruth_rect.txt", 6
FIRST_PIXEL = 1

SPANS: Mapping[str, tuple[int, int | None]] = {
    "blurcar1": (247, None),
    "blurcar3": (3, None),
    "blurcar4": (18, None),
    "david": (300, 770),
    "diving": (1, 215),
    "football1": (1, 74),
    "freeman3": (1, 460),
    "freeman4": (1, 283),
}
"""First and last annotated image of sequences in which only a part of the images is annotated.

None means the last image. In all other sequences, the first image has the number 1, or 0 in some
copies of the benchmark."""


def recognises(path: Path) -> bool:
    """Return whether the folder has `img/` and `groundtruth_rect.txt`, or one file per target.

    Rows of six numbers belong to TLP.
    """
    if not (path / "img").is_dir() or not any(path.glob("groundtruth_rect*.txt")):
        return False
    return not (path / TRUTH).is_file() or count_columns(path / TRUTH) != N_TLP_COLUMNS


def choice(path: Path) -> Choice:
    """Return the option `target` of a folder with several."""
    targets = list(_truth_files(path))
    return Choice("target", targets, targets[0]) if len(targets) > 1 else Choice()


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the folder, by default its first target; tags in `attrs.txt` hold for all frames."""
    name = path.resolve().name
    first, last = SPANS.get(name.lower(), (0, None))
    files = numbered_images(path / "img", 0, 1, first)
    if truth is None:
        targets = _truth_files(path)
        if not targets:
            raise SequenceError(
                f"{path}: there is no {TRUTH}, and no groundtruth_rect.1.txt with rows. Add one of "
                "these files."
            )
        target = value or next(iter(targets))
        source = targets[target]
        values = read_rows(source, {4}, "four numbers, x y width height")
        rows = GroundTruth(as_boxes(values, source, FIRST_PIXEL))
        n_rows = len(rows.boxes)
        if int(files[0].stem) == 0 and n_rows not in (1, len(files)):
            raise SequenceError(
                f"{files[0]}: {n_rows} ground-truth rows for {len(files)} images of "
                f"{name}. It is unknown whether the first row belongs to this image. Remove this "
                "image, or the images without a row."
            )
        later = [file for file in files if int(file.stem) >= first]
        is_part = n_rows == 1 and last is not None and len(files) == last - first + 1
        if len(later) >= n_rows and not is_part:  # otherwise the part is numbered from 1
            files = later
        if n_rows == 1 and last is not None:  # images after the annotated part are not used
            files = files[: last - first + 1]
        if last is None or n_rows != last - first + 1:
            check_row_count(n_rows, files, source)
        name = f"{name}.{target}" if target else name
    else:
        rows, source = truth_file.read(truth), truth
    attrs = path / "attrs.txt"
    tags = truth_file.read_text(attrs).replace(",", " ").split() if attrs.exists() else []
    n = frames_with_values(len(rows.boxes), files)
    return recorded(
        name,
        files,
        rows,
        source,
        attributes={tag: np.ones(n, dtype=np.bool_) for tag in tags},
    )


def _truth_files(path: Path) -> dict[str, Path]:
    """Return non-empty ground-truth files by target; a single target has the name ""."""
    if (path / TRUTH).is_file():
        return {"": path / TRUTH}
    numbered = {file.name.split(".")[1]: file for file in path.glob("groundtruth_rect.*.txt")}
    return {
        number: numbered[number]
        for number in sorted(numbered)
        if number.isascii() and number.isdecimal() and numbered[number].stat().st_size
    }
