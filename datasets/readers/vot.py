"""Sequences of the VOT challenges, as they were (images beside the truth) and as they are now.

A row of `groundtruth.txt` is a box `x,y,width,height`, a polygon `x1,y1,x2,y2,…`, a mask
`mX,Y,WIDTH,HEIGHT,RUN,RUN,…` (runs of pixels outside and inside in turn, row by row), or `0` where
nothing is known; coordinates count from 0, as the toolkit takes them. The box of a polygon or a
mask is the smallest upright one around it. (The GOT-10k toolkit makes a smaller one of a polygon,
of the polygon's area, and adds a pixel to its sides.) A folder with `groundtruth_OBJECT.txt` in its
place, as since 2023, is a sequence an object. Kristan et al., "A novel performance evaluation
methodology for single-target trackers", IEEE TPAMI 38(11), 2016.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import check_pixels, quote
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.image_files import image_files, numbered_images, size_of_first
from trackmark.datasets.interface import Mask, Sequence, SequenceError
from trackmark.datasets.number_files import (
    check_line,
    check_row_count,
    fps_of,
    numbers,
    place_of,
    read_fields,
    read_flags,
    read_rows,
    words,
)
from trackmark.datasets.recorded import recorded_images
from trackmark.datasets.shapes import EncodedMask, Shapes
from trackmark.datasets.spec_string import natural_order

TRUTH, OBJECT, FIELDS = "groundtruth.txt", "groundtruth_", "sequence"
EXPECTS = f"a folder with {TRUTH} and images or color/ (VOT)"
GENERAL = False
MARKS = ("color/", FIELDS, TRUTH, f"{OBJECT}*.txt")
CITATION = (
    "Kristan et al., A novel performance evaluation methodology for single-target trackers, "
    "IEEE TPAMI 38(11), 2016"
)

# Name, images and rows of published sequences whose last image has no row.
PARTIAL = {("ball", 602, 601)}
_ROW = "a box x,y,width,height, a polygon x1,y1,x2,y2,x3,y3,…, a mask mX,Y,WIDTH,HEIGHT,RUN,…, or 0"


def recognises(path: Path) -> bool:
    """Whether the folder holds `groundtruth.txt`, and images called numbers or their folder.

    A truth of one's own beside the images, `truth.csv`, makes it a folder of images.
    """
    if not _truths(path) or (path / "truth.csv").is_file():
        return False
    if any((path / name).exists() for name in (FIELDS, "color")):
        return True
    images = image_files(path) if (path / TRUTH).is_file() else []
    return bool(images) and images[0].stem.isdecimal()


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen where there are several: `object`; see `datasets.options`."""
    objects = list(_truths(path))
    if len(objects) < 2:
        return []
    meaning = f"which object of {', '.join(objects)}"
    return [{"name": "object", "default": objects[0], "meaning": meaning}]


def list_sequences(path: Path) -> list[Path]:
    """All sequences of a folder; see `Splitting`."""
    objects = list(_truths(path))
    several = [path.with_name(f"{path.name}:object={one}") for one in objects]
    return several if len(several) > 1 else [path]


def read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None) -> Sequence:
    """Open the folder; files `*.tag` and `*.label` are attributes, `*.value` are values."""
    name, fields = path.resolve().name, {}
    if (path / FIELDS).is_file():
        fields = read_fields(path / FIELDS)
    images = numbered_images(_channel(path, fields), 1)
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    truths = _truths(path)
    target = (chosen or {}).get("object", next(iter(truths)))
    if target not in truths:
        known = ", ".join(truths)
        raise SequenceError(f"{path}: there is no object {quote(target)}. There are: {known}.")
    source = truths[target] if target else place_of(fields, "groundtruth", path / FIELDS, TRUTH)
    name = f"{name}_{target}" if len(truths) > 1 else name
    regions = _regions(source, images)
    n = len(regions.boxes)
    # Only the first row of some test sets is published.
    if n > 1 and (path.resolve().name, len(images), n) not in PARTIAL:
        check_row_count(n, images, source)
    tags = _files(path, (".tag", ".label"))
    return recorded_images(
        name,
        images,
        truth_file.GroundTruth(regions.boxes),
        source,
        fps=fps_of(fields, "fps", path / FIELDS),
        attributes={file.stem: read_flags(file, n, padded=True) > 0 for file in tags},
        values={file.stem: _values(file, n) for file in _files(path, (".value",))},
        masks=regions.mask if regions.size != (0, 0) else None,
        shapes=Shapes(regions.shapes, range(n), regions.size) if regions.shapes else None,
        digests=lambda files: file_digests([*files, source]),
    )


def _truths(path: Path) -> dict[str, Path]:
    """Truths by object: of a single one, or of those that are told apart; none where none is."""
    if (path / TRUTH).is_file():
        return {"": path / TRUTH}
    files = sorted(path.glob(f"{OBJECT}*.txt"), key=lambda file: natural_order(file.name))
    return {file.stem.removeprefix(OBJECT): file for file in files}


@dataclass(frozen=True)
class _Regions:
    """What the truth says of all frames."""

    boxes: NDArray[np.float64]  # (n, 4); NaN where the target is absent
    shapes: Mapping[int, NDArray[np.float64] | EncodedMask]  # by frame, where there is one
    size: tuple[int, int]  # of the images; only known where there are masks

    def mask(self, frame: int) -> Mask | None:
        """The mask of a frame, where it has one."""
        shape = self.shapes.get(frame)
        return shape.whole(self.size) if isinstance(shape, EncodedMask) else None


def _regions(path: Path, images: list[Path]) -> _Regions:
    lines = truth_file.read_text(path).rstrip().splitlines()
    size = (0, 0)
    if any(line.lstrip().startswith("m") for line in lines):
        size = size_of_first(images)
    boxes = np.full((len(lines), 4), np.nan)
    shapes: dict[int, NDArray[np.float64] | EncodedMask] = {}
    for frame, line in enumerate(lines):
        check_line(line, frame + 1, path)
        try:
            if line.lstrip().startswith("m"):
                shapes[frame] = mask = _encoded(line.strip().removeprefix("m"), size)
                boxes[frame] = mask.box()
            else:
                row = _row(line)
                boxes[frame] = _box(row, first=frame == 0)
                if len(row) > 4 and np.isfinite(boxes[frame]).all():
                    shapes[frame] = np.array(row).reshape(-1, 2)
        except ValueError as error:
            raise SequenceError(f"{path}: line {frame + 1}: {error}.") from None
    if not lines:
        raise SequenceError(f"{path}: there are no rows.")
    return _Regions(boxes, shapes, size)


def _row(line: str) -> list[float]:
    """Numbers of a row that is no mask; none where the target is absent."""
    row = numbers(line)
    unknown = np.isnan(row)
    if row == [0.0] or (unknown.any() and len(row) in (1, 4)) or (len(row) and unknown.all()):
        return []
    if len(row) < 4 or unknown.any() or (len(row) > 4 and len(row) % 2):
        raise ValueError(f"{quote(line.strip())} is no region; expected are {_ROW}")
    return row


def _box(row: list[float], *, first: bool) -> list[float]:
    """Box of a row's numbers; NaN where the target is absent."""
    if not row:
        return [np.nan] * 4
    if len(row) > 4:
        points = np.array(row).reshape(-1, 2)
        row = [*points.min(axis=0), *np.ptp(points, axis=0)]
    elif not first and min(row[2:]) < 0.0:
        raise ValueError("the box has a negative size")
    # Without size it is absent, but not in the first row: there it is a mistake, see `as_boxes`.
    return [np.nan] * 4 if not first and min(row[2:]) == 0.0 else row


def _encoded(text: str, size: tuple[int, int]) -> EncodedMask:
    """A mask that lies in an image of this size."""
    found = words(text)
    if len(found) < 5 or not all(
        word.isascii() and word.isdecimal() and len(word) < 10 for word in found
    ):
        raise ValueError(f"{quote(f'm{text}')} is no mask; expected are {_ROW}")
    x, y, width, height, *runs = map(int, found)
    if x + width > size[0] or y + height > size[1]:
        raise ValueError(
            f"the mask's part of {width}x{height} pixels at {x}, {y} does not lie in the image, "
            f"which has {size[0]}x{size[1]}"
        )
    check_pixels(*size)
    return EncodedMask(x, y, width, height, np.array(runs, np.int64))


def _channel(path: Path, fields: Mapping[str, str]) -> Path:
    """Folder of the images: of colours where there are several kinds."""
    kinds = [key for key in fields if key.startswith("channels.")]
    key = "channels.color" if "channels.color" in kinds or not kinds else kinds[0]
    if key in fields:
        place = place_of(fields, key, path / FIELDS)
        return place.parent if place.suffix else place
    return path / "color" if (path / "color").is_dir() else path


def _values(path: Path, n: int) -> NDArray[np.float64]:
    """A number a frame; 0 where there are fewer, as the toolkit fills up."""
    rows = read_rows(path, {1}, "one number", "a value")[:n, 0]
    return np.pad(rows, (0, n - len(rows)))


def _files(path: Path, suffixes: Iterable[str]) -> list[Path]:
    return sorted(file for file in path.iterdir() if file.suffix in suffixes)
