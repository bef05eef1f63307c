"""Sequences of MOTChallenge: `img1/`, `gt/gt.txt` and `seqinfo.ini`; one of the targets is chosen.

A row of the truth is `frame,target,x,y,width,height,counts,class,visibility`, or ends after
`counts` with three numbers of the ground (2015); frames, targets, x and y count from 1. Rows that
do not count (distractors, reflections) are left out; a frame without a row of the target is one
without it. Milan et al., "MOT16: a benchmark for multi-object tracking", arXiv:1603.00831.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import fps_of, place_of, read_fields, read_rows
from trackmark.datasets.recorded import recorded_images

TRUTH, FIELDS, IMAGES = Path("gt/gt.txt"), "seqinfo.ini", "img1"
EXPECTS = f"a folder with {IMAGES}/ and {TRUTH} (MOTChallenge)"
GENERAL = False
MARKS = (f"{IMAGES}/", str(TRUTH), FIELDS)
CITATION = "Milan et al., MOT16: a benchmark for multi-object tracking, arXiv:1603.00831"

_ROW = "frame, target, x, y, width, height, counts, class, visibility"
_WITH_VISIBILITY, _WITH_GROUND = 9, 10
_SHOWN = 20


def recognises(path: Path) -> bool:
    """Whether the folder holds `gt/gt.txt`, and images in `img1/` or where `seqinfo.ini` says."""
    return (path / TRUTH).is_file() and any((path / part).exists() for part in (IMAGES, FIELDS))


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen: `target`; see `datasets.options`."""
    targets = _targets(path / TRUTH)
    shown = ", ".join(map(str, sorted(targets)[:_SHOWN])) + (", …" if len(targets) > _SHOWN else "")
    meaning = f"which target of {shown}; by default the one of most frames"
    return [{"name": "target", "default": _longest(targets), "meaning": meaning}]


def read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None) -> Sequence:
    """Open the sequence of one target, by default of the one that is in most frames."""
    name = path.resolve().name
    fields = read_fields(path / FIELDS) if (path / FIELDS).is_file() else {}
    images = numbered_images(place_of(fields, "imDir", path / FIELDS, IMAGES), 1)
    fps = fps_of(fields, "frameRate", path / FIELDS)
    length = fields.get("seqLength", str(len(images)))
    if length != str(len(images)):
        raise SequenceError(
            f"{path / FIELDS}: seqLength is {quote(length)}, but there are {len(images)} images of "
            f"{name}. Supply the missing ones, or correct it."
        )
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth, fps=fps)
    targets = _targets(path / TRUTH)
    longest = _longest(targets)
    asked = (chosen or {}).get("target", str(longest))
    if asked not in map(str, targets):
        known = ", ".join(map(str, sorted(targets)[:_SHOWN]))
        raise SequenceError(f"{path}: there is no target {quote(asked)}. There are: {known}, …")
    rows = targets[int(asked)]
    frames = rows[:, 0].astype(int) - 1
    if frames.max() >= len(images):
        raise SequenceError(
            f"{path / TRUTH}: target {asked} is in frame {frames.max() + 1}, but there are "
            f"{len(images)} images of {name}. Supply the missing ones."
        )
    boxes, visible = np.full((len(images), 4), np.nan), np.full(len(images), np.nan)
    boxes[frames] = rows[:, 2:6] - [1.0, 1.0, 0.0, 0.0]
    if rows.shape[1] == _WITH_VISIBILITY:
        visible[frames] = rows[:, 8]
    return recorded_images(
        name if int(asked) == longest else f"{name}:target={asked}",
        images,
        truth_file.GroundTruth(boxes, visible),
        path / TRUTH,
        fps=fps,
    )


def _targets(source: Path) -> dict[int, NDArray[np.float64]]:
    """Rows of each target that counts, by its number, in the order of their frames."""
    rows = read_rows(source, {_WITH_VISIBILITY, _WITH_GROUND}, _ROW, "a row of MOTChallenge")
    whole = (rows[:, :2] == np.floor(rows[:, :2])) & (rows[:, :2] >= (1, 1)) & (rows[:, :2] < 1e9)
    bad = ~whole.all(axis=1) | ~np.isfinite(rows).all(axis=1)
    counts = rows[:, 6] > 0
    bad |= counts & (rows[:, 4:6] <= 0).any(axis=1)
    if rows.shape[1] == _WITH_VISIBILITY:
        bad |= (rows[:, 8] < 0) | (rows[:, 8] > 1)
    order = np.lexsort((rows[:, 0], rows[:, 1]))
    twice = np.flatnonzero((np.diff(rows[order, :2], axis=0) == 0).all(axis=1))
    bad[order[twice + 1]] = True
    if bad.any():
        line = int(np.flatnonzero(bad)[0])
        said = ",".join(f"{value:g}" for value in rows[line])
        raise SequenceError(
            f"{source}: line {line + 1}: {said} is no row of a target with a size, or the second "
            f"of its frame; expected are {_ROW}."
        )
    kept = rows[order][counts[order]]
    if not len(kept):
        raise SequenceError(f"{source}: there is no target that counts.")
    numbers, starts = np.unique(kept[:, 1].astype(int), return_index=True)
    return dict(zip(numbers.tolist(), np.split(kept, starts[1:]), strict=True))


def _longest(targets: Mapping[int, NDArray[np.float64]]) -> int:
    """The target of most frames; of several the one with the lowest number."""
    return max(sorted(targets), key=lambda number: len(targets[number]))
