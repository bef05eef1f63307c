"""Sequences of MOTChallenge: `img1/`, `gt/gt.txt` and `seqinfo.ini`; one target is selected.

A row of the ground truth is `frame,target,x,y,width,height,counts,class,visibility`; files of other
tools end after `counts` or `class`. In 2015, three world coordinates follow `counts`. Frames, x and
y count from 1, targets from 0 or 1. A visibility of -1 is unknown. Rows with `counts` 0
(distractors, reflections) are left out. The target is absent in a frame without a row, unless all
rows are of the first frame: then later frames are not annotated. CVAT names the images
`frame_000000.jpg`, …; the first one is frame 1. Milan et al., "MOT16: a benchmark for multi-object
tracking", arXiv:1603.00831.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Array, Sequence, SequenceError
from trackmark.datasets.number_files import Fields, as_boxes, read_rows
from trackmark.datasets.recorded import Choice, recorded
from trackmark.datasets.truth_file import GroundTruth

TRUTH, FIELDS, IMAGES = Path("gt/gt.txt"), "seqinfo.ini", "img1"
PATH_IS_ONE_TARGET = True
FIRST_PIXEL = 1

_ROW = "frame, target, x, y, width, height, counts, class, visibility"
_SHORTEST, _WITH_VISIBILITY, _WITH_WORLD = 7, 9, 10  # numbers of columns
_CVAT_PREFIX = "frame_"


def recognises(path: Path) -> bool:
    """Return whether the folder has `gt/gt.txt`, and `img1/` or a `seqinfo.ini`."""
    return (path / TRUTH).is_file() and any((path / part).exists() for part in (IMAGES, FIELDS))


def choice(path: Path) -> Choice:
    """Return the option `target`."""
    targets = _read_targets(path / TRUTH)
    remark = "; by default the target in most frames"
    return Choice("target", list(targets), _longest(targets), remark)


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the sequence of one target, by default the target in most frames."""
    name = path.resolve().name
    fields = Fields(path / FIELDS)
    images = _images(fields.location("imDir", IMAGES))
    fps = fields.fps("frameRate")
    length = fields.get("seqLength", str(len(images)))
    if length != str(len(images)):
        raise SequenceError(
            f"{path / FIELDS}: seqLength is {quote(length)}, but there are {len(images)} images of "
            f"{name}. Add the missing images, or correct the file."
        )
    if truth is not None:
        return recorded(name, images, truth_file.read(truth), truth, fps=fps)
    targets = _read_targets(path / TRUTH)
    longest = _longest(targets)
    target = value or longest
    rows = targets[target]
    frames = rows[:, 0].astype(int) - 1
    if frames.max() >= len(images):
        raise SequenceError(
            f"{path / TRUTH}: target {target} is in frame {frames.max() + 1}, but there are "
            f"{len(images)} images of {name}. Add the missing images."
        )
    n = 1 if all(other[:, 0].max() == 1 for other in targets.values()) else len(images)
    boxes, visibility = np.full((n, 4), np.nan), np.full(n, np.nan)
    boxes[frames] = rows[:, 2:6] - [FIRST_PIXEL, FIRST_PIXEL, 0, 0]
    if rows.shape[1] == _WITH_VISIBILITY:
        visibility[frames] = np.where(rows[:, 8] < 0, np.nan, rows[:, 8])
    return recorded(
        name if target == longest else f"{name}:target={target}",
        images,
        GroundTruth(boxes, visibility),
        path / TRUTH,
        fps=fps,
    )


def _images(folder: Path) -> list[Path]:
    """Return the images; those that CVAT names count from 0."""
    if any(folder.glob(f"{_CVAT_PREFIX}*")):
        return numbered_images(folder, 0, names=f"{_CVAT_PREFIX}#")
    return numbered_images(folder, 1)


def _read_targets(source: Path) -> dict[str, Array]:
    """Return the rows of each target with the flag `counts`, sorted by frame."""
    rows = read_rows(source, range(_SHORTEST, _WITH_WORLD + 1), _ROW, "a row of MOTChallenge")
    keys = rows[:, :2]
    is_key = (keys == np.floor(keys)) & (keys >= (1, 0)) & (keys < 1e9)
    invalid = ~is_key.all(axis=1) | ~np.isfinite(rows).all(axis=1)
    counts = rows[:, 6] > 0
    if rows.shape[1] == _WITH_VISIBILITY:
        invalid |= ((rows[:, 8] < 0) & (rows[:, 8] != -1)) | (rows[:, 8] > 1)
    order = np.lexsort((rows[:, 0], rows[:, 1]))
    duplicates = np.flatnonzero((np.diff(keys[order], axis=0) == 0).all(axis=1))
    invalid[order[duplicates + 1]] = True
    if invalid.any():
        line = int(np.flatnonzero(invalid)[0])
        row = ",".join(f"{value:g}" for value in rows[line])
        raise SequenceError(
            f"{source}: line {line + 1}: {row} is invalid, or the target's second row in this "
            f"frame. Expected: {_ROW}; frames count from 1, targets from 0 or 1, and a visibility "
            "is 0 to 1, or -1 if it is unknown."
        )
    counted = np.where(counts[:, None], rows[:, 2:6], np.nan)
    as_boxes(counted, source)  # raises an error if many sizes are negative
    selected = rows[order][counts[order]]
    if not len(selected):
        raise SequenceError(
            f"{source}: the flag `counts` is 0 in all rows. Expected: 1 for a target."
        )
    targets, starts = np.unique(selected[:, 1].astype(int), return_index=True)
    return dict(zip(map(str, targets), np.split(selected, starts[1:]), strict=True))


def _longest(targets: Mapping[str, Array]) -> str:
    """Return the number of the target in most frames; of equal targets, the lowest number."""
    return max(targets, key=lambda target: len(targets[target]))
