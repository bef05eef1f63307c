"""Sequences of Temple Color 128: `img/`, `NAME_gt.txt` and `NAME_frames.txt` (first, last).

A row of the ground truth is `x,y,width,height`; x and y count from 1, as the OTB toolkit expects.
The benchmark is written for this toolkit. Liang, Blasch, Ling, "Encoding color information for
visual tracking: algorithms and benchmark", IEEE TIP 24(12), 2015.
"""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images, recorded_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import read_boxes, read_rows
from trackmark.datasets.truth_file import GroundTruth

TRUTH, RANGE = "_gt.txt", "_frames.txt"
EXPECTS = f"a folder with img/, NAME{TRUTH} and NAME{RANGE} (TColor-128)"
MARKS = ("img/", f"NAME{TRUTH}", f"NAME{RANGE}")
FIRST_PIXEL = 1
CITATION = (
    "Liang, Blasch, Ling, Encoding color information for visual tracking: algorithms and "
    "benchmark, IEEE TIP 24(12), 2015"
)


def recognises(path: Path) -> bool:
    """Return whether the folder has `img/`, and one ground-truth file with its range of images."""
    return (path / "img").is_dir() and _files(path) is not None


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the sequence of the images in the range."""
    files = _files(path)
    assert files is not None  # `recognises` is true
    source, span = files
    name, folder = path.resolve().name, path / "img"
    rows = read_rows(span, {2}, "the numbers of the first and the last image", "a range")
    first, last = rows[0].tolist()
    images = {int(file.stem): file for file in numbered_images(folder)}
    for image_number in (first, last):
        if image_number not in images or last < first or len(rows) > 1:
            raise SequenceError(
                f"{span}: there is no image {image_number:g} in {folder}. Expected: the numbers of "
                f"the first and the last image, from {min(images)} to {max(images)}, in one line."
            )
    in_range = [file for image_number, file in images.items() if first <= image_number <= last]
    if truth is not None:
        return recorded_images(name, in_range, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=FIRST_PIXEL)
    if len(boxes) not in (1, len(in_range)):
        raise SequenceError(
            f"{source}: {len(boxes)} rows for {len(in_range)} images in the range of {span.name}."
        )
    return recorded_images(name, in_range, GroundTruth(boxes), source)


def _files(path: Path) -> tuple[Path, Path] | None:
    """Return the files of ground truth and range; None unless there is exactly one pair."""
    pairs = [
        (file, other)
        for file in path.glob(f"*{TRUTH}")
        if (other := file.with_name(file.name.removesuffix(TRUTH) + RANGE)).is_file()
    ]
    return pairs[0] if len(pairs) == 1 else None
