"""Sequences of UAV123 and UAV20L: `data_seq/UAV123/FOLDER/` and `anno/UAV123/NAME.txt`.

Some sequences are parts of one folder of images, listed in the benchmark's `configSeqs.m` and in
`PARTS`. A row of the ground truth is `x,y,width,height`; x and y count from 1, as the OTB toolkit
expects. The benchmark is written for this toolkit. The target is absent in NaN rows. Müller, Smith,
Ghanem, "A benchmark and simulator for UAV tracking", ECCV 2016.
"""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.image_files import (
    check_frame_numbers,
    image_files,
    numbered_images,
    recorded_images,
)
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import check_row_count, read_boxes
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import GroundTruth

IMAGES, TRUTHS = Path("data_seq/UAV123"), ("anno/UAV123", "anno/UAV20L")
EXPECTS = f"a name of {TRUTHS[0]}/NAME.txt in a folder with {IMAGES} (UAV123)"
FIRST_PIXEL = 1
CITATION = "Müller, Smith, Ghanem, A benchmark and simulator for UAV tracking, ECCV 2016"

# first and last image of each part of a folder: bird1_1, bird1_2, …
PARTS = {
    "bird1": ((1, 253), (775, 1477), (1573, 2437)),
    "car1": ((1, 751), (751, 1627), (1627, 2629)),
    "car6": ((1, 487), (487, 1807), (1807, 2953), (2953, 3925), (3925, 4861)),
    "car8": ((1, 1357), (1357, 2575)),
    "car16": ((1, 415), (415, 1993)),
    "group1": ((1, 1333), (1333, 2515), (2515, 3925), (3925, 4873)),
    "group2": ((1, 907), (907, 1771), (1771, 2683)),
    "group3": ((1, 1567), (1567, 2827), (2827, 4369), (4369, 5527)),
    "person2": ((1, 1189), (1189, 2623)),
    "person4": ((1, 1501), (1501, 2743)),
    "person5": ((1, 877), (877, 2101)),
    "person7": ((1, 1249), (1249, 2065)),
    "person8": ((1, 1075), (1075, 1525)),
    "person12": ((1, 601), (601, 1621)),
    "person14": ((1, 847), (847, 1813), (1813, 2923)),
    "person17": ((1, 1501), (1501, 2347)),
    "person19": ((1, 1243), (1243, 2791), (2791, 4357)),
    "truck4": ((1, 577), (577, 1261)),
    "uav1": ((1, 1555), (1555, 2377), (2473, 3469)),
}


def recognises(path: Path) -> bool:
    """Return whether the path is a ground-truth file, `ROOT/NAME`, or an image folder.

    `NAME` is the name of a sequence, which an image folder must also have.
    """
    return _locate(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Return the sequences in the root folder or a ground-truth folder; see `ReaderOfMany`.

    Images without ground truth are omitted, because UAV20L uses only some images of UAV123.
    """
    if "/".join(folder.absolute().parts[-2:]) in TRUTHS:
        members = list(folder.glob("*.txt"))
    else:
        names = [{file.stem for file in (folder / truths).glob("*.txt")} for truths in TRUTHS]
        members = [folder / name for name in names[0] or names[1]]
    return sorted(members, key=lambda path: natural_order(path.name))


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the sequence."""
    location = _locate(path)
    assert location is not None  # `recognises` is true
    folder, source = location
    images = _sequence_images(folder, source.stem)
    if truth is not None:
        return recorded_images(source.stem, images, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=FIRST_PIXEL)
    check_row_count(len(boxes), images, source)
    return recorded_images(source.stem, images, GroundTruth(boxes), source)


def _sequence_images(folder: Path, name: str) -> list[Path]:
    """Return the images of a sequence, which can be a part of its folder."""
    if folder.name == name:
        return numbered_images(folder, 1)
    first, last = PARTS[folder.name][int(name.rpartition("_")[2]) - 1]
    files = image_files(folder)
    check_frame_numbers(files)
    file_of_number = {int(file.stem): file for file in files if file.stem.isdecimal()}
    for image_number in range(first, last + 1):
        if image_number not in file_of_number:
            raise SequenceError(
                f"{folder / f'{image_number:06}.jpg'}: this image is missing; {name} consists of "
                f"images {first} to {last}. Add the file."
            )
    return [file_of_number[image_number] for image_number in range(first, last + 1)]


def _locate(path: Path) -> tuple[Path, Path] | None:
    """Return a sequence's image folder and ground-truth file; None for another format."""
    full = path.resolve()
    root = full.parent
    if full.suffix == ".txt" and "/".join(root.parts[-2:]) in TRUTHS and full.is_file():
        folder = root.parents[1] / IMAGES / _folder_name(full.stem)
        return (folder, full) if folder.is_dir() else None
    if Path(*root.parts[-2:]) == IMAGES:
        root = root.parents[1]
    for truths in TRUTHS:
        folder, truth = root / IMAGES / _folder_name(full.name), root / truths / f"{full.name}.txt"
        if folder.is_dir() and truth.is_file():
            return folder, truth
    return None


def _folder_name(name: str) -> str:
    """Return the name of a sequence's image folder: `bird1` for `bird1_2`."""
    folder, _, part = name.rpartition("_")
    is_part = part.isascii() and part.isdecimal() and len(part) < 3
    return folder if is_part and 1 <= int(part) <= len(PARTS.get(folder, ())) else name
