"""Sequences of the VOT challenges in their former and current layouts.

A row of `groundtruth.txt` is a box `x,y,width,height`, a polygon `x1,y1,x2,y2,…`, a mask
`mX,Y,WIDTH,HEIGHT,RUN,RUN,…` (lengths of alternating runs outside and inside, row by row), or a
code: `0` if the frame is not annotated, `1` if the target is not visible (`UNKNOWN` and `INVISIBLE`
of the VOT toolkit, used since VOTS 2023). The target is also absent in rows of NaN, which mark
absence in the long-term challenges. Coordinates count from 0, as in the VOT toolkit.

The box of a polygon or a mask is the smallest upright box around it. The GOT-10k toolkit instead
uses a box of the polygon's area, and adds one pixel to its sides. Former layouts have the images
next to `groundtruth.txt`, the current one in `color/`. Since 2023, a folder has several
`groundtruth_OBJECT.txt`, one sequence each. Kristan et al., "A novel performance evaluation
methodology for single-target trackers", IEEE TPAMI 38(11), 2016.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import check_pixels, quote
from trackmark.datasets.image_files import (
    image_files,
    numbered_images,
    size_of_first,
)
from trackmark.datasets.interface import Array, Sequence, SequenceError
from trackmark.datasets.number_files import (
    Fields,
    as_boxes,
    box_of_region,
    check_decimals,
    check_line,
    check_row_count,
    frames_with_values,
    parse_numbers,
    read_flags,
    read_lines,
    read_rows,
    split_line,
)
from trackmark.datasets.recorded import Choice, recorded
from trackmark.datasets.shapes import EncodedMask, Shapes
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import GroundTruth

TRUTH, OBJECT, FIELDS = "groundtruth.txt", "groundtruth_", "sequence"

# name, number of images and number of rows of published sequences without the last row
PARTIAL = {("ball", 602, 601)}
_NOT_ANNOTATED, _NOT_VISIBLE = [0.0], [1.0]  # codes of the VOT toolkit
_ROW = (
    "a box x,y,width,height, a polygon x1,y1,x2,y2,x3,y3,…, a mask mX,Y,WIDTH,HEIGHT,RUN,…, 0 or 1"
)


def recognises(path: Path) -> bool:
    """Return whether the folder has `groundtruth.txt`, and numbered images or their folder.

    The reader of image folders opens a folder with a `truth.csv`.
    """
    if not _truth_files(path) or (path / "truth.csv").is_file():
        return False
    if any((path / name).exists() for name in (FIELDS, "color")):
        return True
    images = image_files(path) if (path / TRUTH).is_file() else []
    return bool(images) and images[0].stem.isdecimal()


def choice(path: Path) -> Choice:
    """Return the option `object` of a folder with several."""
    objects = list(_truth_files(path))
    return Choice("object", objects, objects[0]) if len(objects) > 1 else Choice()


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the folder: `*.tag` and `*.label` are attributes, `*.value` are frame values."""
    name, fields = path.resolve().name, Fields(path / FIELDS)
    images = numbered_images(_image_folder(path, fields), 1)
    if truth is not None:
        return recorded(name, images, truth_file.read(truth), truth)
    truths = _truth_files(path)
    target = value or next(iter(truths))
    source = truths[target] if target else fields.location("groundtruth", TRUTH)
    name = f"{name}_{target}" if len(truths) > 1 else name
    ground_truth, shapes = _read_regions(source, images)
    n = len(ground_truth.boxes)
    if (path.resolve().name, len(images), n) not in PARTIAL:
        check_row_count(n, images, source)
    n_values = frames_with_values(n, images)
    return recorded(
        name,
        images,
        ground_truth,
        source,
        fps=fields.fps("fps"),
        attributes=read_flags(_files(path, ["*.tag", "*.label"]), n_values, padded=True),
        frame_values={
            file.stem: _read_values(file, n_values) for file in _files(path, ["*.value"])
        },
        masks=None if shapes is None else shapes.mask,
        shapes=shapes,
        further_files=[source],
    )


def _truth_files(path: Path) -> dict[str, Path]:
    """Return the ground-truth files by object; a single object has the name ""."""
    if (path / TRUTH).is_file():
        return {"": path / TRUTH}
    files = sorted(path.glob(f"{OBJECT}*.txt"), key=lambda file: natural_order(file.name))
    return {file.stem.removeprefix(OBJECT): file for file in files}


def _read_regions(path: Path, images: list[Path]) -> tuple[GroundTruth, Shapes | None]:
    """Read boxes, and polygons and masks if there are any."""
    lines = [line for _, line in read_lines(path)]
    size = (0, 0)
    if any(line.lstrip().startswith("m") for line in lines):
        size = size_of_first(images)
    boxes = np.full((len(lines), 4), np.nan)
    annotated = np.ones(len(lines), np.bool_)
    masks: dict[int, EncodedMask] = {}
    polygons: dict[int, Array] = {}
    for frame, line in enumerate(lines):
        check_line(line, frame + 1, path)
        try:
            if line.lstrip().startswith("m"):
                masks[frame] = mask = _parse_mask(line.strip().removeprefix("m"), size)
                boxes[frame] = mask.box()
            else:
                row = _parse_row(line)
                annotated[frame] = row != _NOT_ANNOTATED
                boxes[frame] = box_of_region(row)
                if len(row) > 4:
                    polygons[frame] = np.array(row).reshape(-1, 2)
        except ValueError as error:
            raise SequenceError(f"{path}: line {frame + 1}: {error}.") from None
    check_decimals(lines, path)
    boxes = as_boxes(boxes, path)
    polygons = {frame: polygon for frame, polygon in polygons.items() if boxes[frame, 2] >= 0.0}
    shapes: dict[int, Array | EncodedMask] = {**masks, **polygons}
    return (
        GroundTruth(boxes, annotated=annotated),
        Shapes(shapes, range(len(lines)), size) if shapes else None,
    )


def _parse_row(line: str) -> list[float]:
    """Return the numbers of a box or polygon, or a code; an empty list for a row of NaN."""
    row = parse_numbers(line)
    unknown = np.isnan(row)
    if (unknown.any() and len(row) in (1, 4)) or (len(row) and unknown.all()):
        return []
    if row in (_NOT_ANNOTATED, _NOT_VISIBLE):
        return row
    if len(row) < 4 or unknown.any() or (len(row) > 4 and len(row) % 2):
        raise ValueError(f"{quote(line.strip())} is not a region. Expected: {_ROW}")
    return row


def _parse_mask(row: str, size: tuple[int, int]) -> EncodedMask:
    """Return the mask of a row; it must lie inside an image of this size."""
    values = split_line(row)
    if len(values) < 5 or not all(
        word.isascii() and word.isdecimal() and len(word) < 10 for word in values
    ):
        raise ValueError(f"{quote(f'm{row}')} is not a mask. Expected: {_ROW}")
    x, y, width, height, *runs = map(int, values)
    if x + width > size[0] or y + height > size[1]:
        raise ValueError(
            f"the mask of {width}x{height} pixels at {x}, {y} does not lie inside the image of "
            f"{size[0]}x{size[1]} pixels"
        )
    check_pixels(*size)
    return EncodedMask(x, y, width, height, np.array(runs, np.int64))


def _image_folder(path: Path, fields: Fields) -> Path:
    """Return the folder of the images; if there are several channels, of the colour images."""
    channels = [key for key in fields if key.startswith("channels.")]
    key = "channels.color" if "channels.color" in channels or not channels else channels[0]
    if key in fields:
        pattern = fields.location(key)
        return pattern.parent if pattern.suffix else pattern
    return path / "color" if (path / "color").is_dir() else path


def _read_values(path: Path, n: int) -> Array:
    """Read one number per frame; missing numbers at the end are 0, as in the VOT toolkit."""
    rows = read_rows(path, {1}, "one number", "a value")[:n, 0]
    return np.pad(rows, (0, n - len(rows)))


def _files(path: Path, patterns: Iterable[str]) -> list[Path]:
    """Return the files that match one of the patterns, sorted."""
    return sorted(file for pattern in patterns for file in path.glob(pattern))
