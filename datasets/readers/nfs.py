"""Sequences of Need for Speed: `NAME/30/NAME/` with `NAME/30/NAME.txt`, and the same in `NAME/240`.

A row of the truth is one of VATIC: track, left, top, right, bottom (from 0), frame, and whether the
target is lost (absent), occluded and generated, then its name. Of 30 images a second some truths
have the rows of all 240, of which every eighth counts; the last eight may be fewer, and then have
an image or none. Kiani Galoogahi et al., "Need for speed: a
benchmark for higher frame rate object tracking", ICCV 2017.
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import as_boxes, check_line, numbers
from trackmark.datasets.recorded import recorded_images

RATES = ("30", "240")
EXPECTS = "a folder NAME/30 or NAME/240 with NAME/ and NAME.txt (NfS)"
GENERAL = False
MARKS = tuple(f"{rate}/NAME{end}" for rate in RATES for end in ("/", ".txt"))
CITATION = (
    "Kiani Galoogahi et al., Need for speed: a benchmark for higher frame rate object tracking, "
    "ICCV 2017"
)

_COLUMNS = 9
_ROW = "track left top right bottom frame lost occluded generated, and a name"


def recognises(path: Path) -> bool:
    """Whether it is a sequence's folder, or the one of a rate in it."""
    return bool(_places(path))


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen: `fps`; see `datasets.options`."""
    rates = list(_places(path))
    meaning = f"which rate of {', '.join(rates)} images a second"
    return [{"name": "fps", "default": int(rates[0]), "meaning": meaning}]


def read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None) -> Sequence:
    """Open the sequence, by default of 30 images a second; occlusion is an attribute."""
    places = _places(path)
    rate = (chosen or {}).get("fps", next(iter(places)))
    if rate not in places:
        raise SequenceError(
            f"{path}: there is no rate {quote(rate)}. There are: {', '.join(places)}."
        )
    folder, source = places[rate]
    name = source.stem if rate == RATES[0] else f"{source.stem}:fps={rate}"
    images = numbered_images(folder, 1)
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth, fps=float(rate))
    rows = _rows(source)
    if rate == RATES[0] and abs(len(rows) - 8 * len(images)) < 8:
        rows = rows[::8][: len(images)]
    sides = np.column_stack([rows[:, 1:3], rows[:, 3:5] - rows[:, 1:3]])
    boxes = as_boxes(sides, source)
    boxes[rows[:, 6] > 0] = np.nan
    return recorded_images(
        name,
        images,
        truth_file.GroundTruth(boxes),
        source,
        fps=float(rate),
        attributes={"occlusion": rows[:, 7] > 0},
    )


def _rows(source: Path) -> NDArray[np.float64]:
    """Numbers of the truth, shape (n, 9): without the names, which may hold spaces."""
    rows: list[list[float]] = []
    for number, line in enumerate(truth_file.read_text(source).rstrip().splitlines(), 1):
        check_line(line, number, source)
        row = numbers(" ".join(line.split()[:_COLUMNS]))
        if len(row) != _COLUMNS or not set(row[6:]) <= {0.0, 1.0}:
            raise SequenceError(
                f"{source}: line {number}: {quote(line.strip())} is no row of VATIC; expected are "
                f"{_ROW}."
            )
        if rows and row[5] <= rows[-1][5]:
            raise SequenceError(
                f"{source}: line {number}: frame {row[5]:g} follows frame {rows[-1][5]:g}."
            )
        rows.append(row)
    if not rows:
        raise SequenceError(f"{source}: there are no rows.")
    _check_frames([row[5] for row in rows], source)
    return np.array(rows)


def _check_frames(frames: list[float], source: Path) -> None:
    """Refuse frame numbers with a gap, or that begin too late: a row is missing.

    Raises `SequenceError` naming the line.
    """
    steps = [after - before for before, after in pairwise(frames)]
    usual = min(steps, default=1.0)
    remedy = "Add the missing row, or download the file again."
    for line, step in enumerate(steps, 2):
        if step != usual:
            raise SequenceError(
                f"{source}: line {line}: frame {frames[line - 1]:g} follows frame "
                f"{frames[line - 2]:g}, but other rows are {usual:g} apart. {remedy}"
            )
    if frames[0] > max(usual - 1, 1):
        raise SequenceError(
            f"{source}: line 1: the first frame is {frames[0]:g}. Expected is 0 or 1. {remedy}"
        )


def _places(path: Path) -> dict[str, tuple[Path, Path]]:
    """Folder of images, and truth, by rate; what the path leaves open there may be several of."""
    whole = path.resolve()
    rates = [whole.name] if whole.name in RATES else RATES
    root = whole.parent if whole.name in RATES else whole
    found = {rate: (root / rate / root.name, root / rate / f"{root.name}.txt") for rate in rates}
    return {
        rate: (images, truth)
        for rate, (images, truth) in found.items()
        if images.is_dir() and truth.is_file()
    }
