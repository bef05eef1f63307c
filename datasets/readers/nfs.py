"""Sequences of Need for Speed: `NAME/30/NAME/`, `NAME/30/NAME.txt`, and equally in `NAME/240`.

A row of the ground truth has the format of VATIC: track, left, top, right, bottom (from 0), frame,
three flags (lost: the target is absent; occluded; generated), and the name. Some files for 30
frames/s have the rows for 240 frames/s, of which only every eighth row is used. At the end, fewer
than eight rows can remain, with or without an image. Kiani Galoogahi et al., "Need for speed: a
benchmark for higher frame rate object tracking", ICCV 2017.
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Array, Sequence, SequenceError
from trackmark.datasets.number_files import as_boxes, check_form, check_line, numbers
from trackmark.datasets.recorded import choose, describe_option
from trackmark.datasets.truth_file import GroundTruth

RATES = ("30", "240")
EXPECTS = "a folder NAME/30 or NAME/240 with NAME/ and NAME.txt (NfS)"
MARKS = tuple(f"{rate}/NAME{end}" for rate in RATES for end in ("/", ".txt"))
CITATION = (
    "Kiani Galoogahi et al., Need for speed: a benchmark for higher frame rate object tracking, "
    "ICCV 2017"
)

_COLUMNS = 9
_ROW = "track left top right bottom frame lost occluded generated, and a name"


def recognises(path: Path) -> bool:
    """Return whether the path is a sequence's folder, or the folder of a frame rate in it."""
    return bool(_locate(path))


def options(path: Path) -> list[dict[str, Any]]:
    """Return the option `fps`; see `datasets.options`."""
    rates = list(_locate(path))
    return [describe_option("fps", rates, int(rates[0]), " [frames/s]")]


def read(path: Path, truth: Path | None, options: Mapping[str, str]) -> Sequence:
    """Open the sequence, by default at 30 frames/s; its attribute is `occlusion`."""
    locations = _locate(path)
    rate = choose(path, "fps", locations, options)
    folder, source = locations[rate]
    name = source.stem if rate == RATES[0] else f"{source.stem}:fps={rate}"
    images = numbered_images(folder, 1)
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth, fps=float(rate))
    rows = _rows(source)
    if rate == RATES[0] and abs(len(rows) - 8 * len(images)) < 8:
        rows = rows[::8][: len(images)]
    boxes = as_boxes(np.column_stack([rows[:, 1:3], rows[:, 3:5] - rows[:, 1:3]]), source)
    boxes[rows[:, 6] > 0] = np.nan
    return recorded_images(
        name,
        images,
        GroundTruth(boxes),
        source,
        fps=float(rate),
        attributes={"occlusion": rows[:, 7] > 0},
    )


def _rows(source: Path) -> Array:
    """Return the numbers of all rows, shape (n, 9), without the name at the end of a row."""
    rows: list[list[float]] = []
    for line_number, line in enumerate(truth_file.read_text(source).rstrip().splitlines(), 1):
        check_line(line, line_number, source)
        values = " ".join(line.split()[:_COLUMNS])
        check_form(values, line_number, source)
        row = numbers(values)
        if len(row) != _COLUMNS or not set(row[6:]) <= {0.0, 1.0}:
            raise SequenceError(
                f"{source}: line {line_number}: {quote(line.strip())} is not a row of VATIC. "
                f"Expected: {_ROW}."
            )
        if rows and row[5] <= rows[-1][5]:
            raise SequenceError(
                f"{source}: line {line_number}: frame {row[5]:g} follows frame {rows[-1][5]:g}."
            )
        rows.append(row)
    if not rows:
        raise SequenceError(f"{source}: there are no rows. Expected: one row per frame.")
    _check_frames([row[5] for row in rows], source)
    return np.array(rows)


def _check_frames(frames: list[float], source: Path) -> None:
    """Check that the frame numbers have no gap and start at 0 or 1: otherwise a row is missing.

    Raises `SequenceError` naming the line.
    """
    steps = [after - before for before, after in pairwise(frames)]
    usual_step = min(steps, default=1.0)
    remedy = "Add the missing row, or download the file again."
    for line, step in enumerate(steps, 2):
        if step != usual_step:
            raise SequenceError(
                f"{source}: line {line}: frame {frames[line - 1]:g} follows frame "
                f"{frames[line - 2]:g}, but other rows are {usual_step:g} apart. {remedy}"
            )
    if frames[0] > max(usual_step - 1, 1):
        raise SequenceError(
            f"{source}: line 1: the first frame is {frames[0]:g}. Expected: 0 or 1. {remedy}"
        )


def _locate(path: Path) -> dict[str, tuple[Path, Path]]:
    """Return image folder and ground-truth file by frame rate; none for another format."""
    full = path.resolve()
    rates = [full.name] if full.name in RATES else RATES
    root = full.parent if full.name in RATES else full
    pairs = {rate: (root / rate / root.name, root / rate / f"{root.name}.txt") for rate in rates}
    return {
        rate: (images, truth)
        for rate, (images, truth) in pairs.items()
        if images.is_dir() and truth.is_file()
    }
