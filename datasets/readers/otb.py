"""Sequences of the Object Tracking Benchmark: `img/` and `groundtruth_rect.txt`.

Wu, Lim, Yang, "Object tracking benchmark", IEEE TPAMI 37(9), 2015. A row of the truth is
`x, y, width, height`, separated by commas, tabs or spaces; x and y count from 1. A folder with
`groundtruth_rect.1.txt` and `groundtruth_rect.2.txt` is two sequences, Jogging.1 and Jogging.2;
toolkits call them so, or Jogging-1 or Jogging_1.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import check_row_count, columns, read_boxes
from trackmark.datasets.recorded import recorded_images

TRUTH, TLP_COLUMNS = "groundtruth_rect.txt", 6
EXPECTS = f"a folder with img/ and {TRUTH} (OTB)"
GENERAL = False
MARKS = ("img/", "groundtruth_rect*.txt")
CITATION = "Wu, Lim, Yang, Object tracking benchmark, IEEE TPAMI 37(9), 2015"

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
"""First and last image with a row, of sequences that have others; None: the last image has a row.

In all other sequences the first image is 1, or 0 in data of other origin."""


def recognises(path: Path) -> bool:
    """Whether the folder holds `img/` and a `groundtruth_rect.txt`, be it of one of several.

    Rows of six numbers are those of TLP.
    """
    if not (path / "img").is_dir() or not any(path.glob("groundtruth_rect*.txt")):
        return False
    return not (path / TRUTH).is_file() or columns(path / TRUTH) != TLP_COLUMNS


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen where there are several: `target`; see `datasets.options`."""
    targets = list(_truths(path))
    if len(targets) < 2:
        return []
    meaning = f"which target of {', '.join(targets)}"
    return [{"name": "target", "default": int(targets[0]), "meaning": meaning}]


def list_sequences(path: Path) -> list[Path]:
    """All sequences of a folder; see `Splitting`."""
    targets = list(_truths(path))
    several = [path.with_name(f"{path.name}:target={target}") for target in targets]
    return several if len(several) > 1 else [path]


def read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None) -> Sequence:
    """Open the folder, by default of its first target; tags in `attrs.txt` hold for all frames."""
    name = path.resolve().name
    first, last = SPANS.get(name.lower(), (0, None))
    files = numbered_images(path / "img", 0, 1, first)
    if truth is None:
        targets = _truths(path)
        if not targets:
            raise SequenceError(
                f"{path}: there is no {TRUTH}, nor a groundtruth_rect.1.txt with rows. Copy the "
                f"truth that you want to {TRUTH}."
            )
        target = (chosen or {}).get("target", next(iter(targets)))
        if target not in targets:
            known = ", ".join(targets)
            raise SequenceError(f"{path}: there is no target {quote(target)}. There are: {known}.")
        source = targets[target]
        rows = truth_file.GroundTruth(read_boxes(source, origin=1.0))
        if int(files[0].stem) == 0 and len(files) != len(rows.boxes):
            raise SequenceError(
                f"{files[0]}: {len(rows.boxes)} ground-truth rows for {len(files)} images of "
                f"{name} leave open whether they begin with this one. Remove it, or the images "
                "without a row."
            )
        later = [file for file in files if int(file.stem) >= first]
        if len(later) >= len(rows.boxes):  # else the images were cut out and numbered anew
            files = later
        if last is None or len(rows.boxes) != last - first + 1:
            check_row_count(len(rows.boxes), files, source)
        name = f"{name}.{target}" if target else name
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


def _truths(path: Path) -> dict[str, Path]:
    """Truths by target: one alone, or the numbered ones but for those that are empty (Human4)."""
    if (path / TRUTH).is_file():
        return {"": path / TRUTH}
    numbered = {file.name.split(".")[1]: file for file in path.glob("groundtruth_rect.*.txt")}
    return {
        number: numbered[number]
        for number in sorted(numbered)
        if number.isascii() and number.isdecimal() and numbered[number].stat().st_size
    }
