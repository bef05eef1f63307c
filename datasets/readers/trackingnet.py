"""Sequences of TrackingNet: `SET/frames/NAME/` and, beside, `SET/anno/NAME.txt`.

A row of the truth is `x,y,width,height`, from 0: nothing else is stated. Of the set TEST only the
first box is public: the frames behind it have no truth and are not scored. Müller et al.,
"TrackingNet: a large-scale dataset and benchmark for object tracking in the wild", ECCV 2018.
"""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import numbered_images
from trackmark.datasets.interface import Sequence
from trackmark.datasets.number_files import check_row_count, read_boxes, without_rest
from trackmark.datasets.recorded import recorded_images
from trackmark.datasets.spec_string import natural_order

IMAGES, TRUTHS = "frames", "anno"
EXPECTS = f"a folder {IMAGES}/NAME with {TRUTHS}/NAME.txt (TrackingNet)"
GENERAL = False
MARKS: tuple[str, ...] = ()
CITATION = (
    "Müller et al., TrackingNet: a large-scale dataset and benchmark for object tracking in the "
    "wild, ECCV 2018"
)


def recognises(path: Path) -> bool:
    """Whether it is a sequence's folder of images, or its name in the folder of its set."""
    return _place(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Sequences of a set (`TEST`, `TRAIN_0`, …); see `Collecting`."""
    if not ((folder / TRUTHS).is_dir() and (folder / IMAGES).is_dir()):
        return []
    names = {file.stem for file in (folder / TRUTHS).glob("*.txt")}
    names |= {place.name for place in (folder / IMAGES).iterdir() if place.is_dir()}
    return [folder / IMAGES / name for name in sorted(names, key=natural_order)]


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the sequence."""
    place = _place(path)
    assert place is not None  # asked of what is recognised alone
    images, source = numbered_images(place[0], 0), place[1]
    if truth is not None:
        return recorded_images(source.stem, images, truth_file.read(truth), truth)
    boxes = without_rest(read_boxes(source), len(images))
    check_row_count(len(boxes), images, source)
    return recorded_images(source.stem, images, truth_file.GroundTruth(boxes), source)


def _place(path: Path) -> tuple[Path, Path] | None:
    """Folder of a sequence's images, and its truth; None where this is none."""
    whole = path.resolve()
    root = whole.parents[1] if whole.parent.name == IMAGES else whole.parent
    images, truth = root / IMAGES / whole.name, root / TRUTHS / f"{whole.name}.txt"
    own = (images / "truth.csv").is_file()  # makes it a folder of images
    return (images, truth) if images.is_dir() and truth.is_file() and not own else None
