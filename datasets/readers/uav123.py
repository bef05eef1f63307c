"""Sequences of UAV123 and UAV20L: `data_seq/UAV123/FOLDER/` and `anno/UAV123/NAME.txt`.

Several sequences are parts of one folder of images, which a table tells as in the benchmark's own
`configSeqs.m`. A row of the truth is `x,y,width,height`; x and y count from 1, as in the OTB
toolkit, for which it is written; the target is absent where it is NaN. Müller, Smith, Ghanem, "A
benchmark and simulator for UAV tracking", ECCV 2016.
"""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.frame_numbers import check_frame_numbers
from trackmark.datasets.image_files import image_files, numbered_images
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.number_files import check_row_count, read_boxes
from trackmark.datasets.recorded import recorded_images
from trackmark.datasets.spec_string import natural_order

IMAGES, TRUTHS = Path("data_seq/UAV123"), ("anno/UAV123", "anno/UAV20L")
EXPECTS = f"a name of {TRUTHS[0]}/NAME.txt in a folder with {IMAGES} (UAV123)"
GENERAL = False
MARKS: tuple[str, ...] = ()
CITATION = "Müller, Smith, Ghanem, A benchmark and simulator for UAV tracking, ECCV 2016"

# First and last image of the parts of a folder: bird1_1, bird1_2, …
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
    """Whether it is a sequence's file of truth, its name in the folder that holds all, or images.

    Images are taken for the sequence of the same name, where there is one.
    """
    return _place(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Sequences in a folder of the whole benchmark, or in one of truths; see `Collecting`.

    Images without truth are not among them: those of UAV20L are some of UAV123's.
    """
    if "/".join(folder.absolute().parts[-2:]) in TRUTHS:
        found = list(folder.glob("*.txt"))
    else:
        names = [{file.stem for file in (folder / truths).glob("*.txt")} for truths in TRUTHS]
        found = [folder / name for name in names[0] or names[1]]
    return sorted(found, key=lambda path: natural_order(path.name))


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the sequence."""
    place = _place(path)
    assert place is not None  # asked of what is recognised alone
    folder, source = place
    images = _part(folder, source.stem)
    if truth is not None:
        return recorded_images(source.stem, images, truth_file.read(truth), truth)
    boxes = read_boxes(source, origin=1.0)
    check_row_count(len(boxes), images, source)
    return recorded_images(source.stem, images, truth_file.GroundTruth(boxes), source)


def _part(folder: Path, name: str) -> list[Path]:
    """Images of a sequence, of those in its folder."""
    if folder.name == name:
        return numbered_images(folder, 1)
    first, last = PARTS[folder.name][int(name.rpartition("_")[2]) - 1]
    files = image_files(folder)
    check_frame_numbers(files)
    numbers = {int(file.stem): file for file in files if file.stem.isdecimal()}
    for number in range(first, last + 1):
        if number not in numbers:
            raise SequenceError(
                f"{folder / f'{number:06}.jpg'}: there is no such image; {name} goes from {first} "
                f"to {last}. Get the file."
            )
    return [numbers[number] for number in range(first, last + 1)]


def _place(path: Path) -> tuple[Path, Path] | None:
    """Folder of a sequence's images, and its truth; None where this is none."""
    whole = path.resolve()
    root = whole.parent
    if whole.suffix == ".txt" and "/".join(root.parts[-2:]) in TRUTHS and whole.is_file():
        folder = root.parents[1] / IMAGES / _folder(whole.stem)
        return (folder, whole) if folder.is_dir() else None
    if Path(*root.parts[-2:]) == IMAGES:
        root = root.parents[1]
    for truths in TRUTHS:
        folder, truth = root / IMAGES / _folder(whole.name), root / truths / f"{whole.name}.txt"
        if folder.is_dir() and truth.is_file():
            return folder, truth
    return None


def _folder(name: str) -> str:
    """Name of the folder that a sequence's images are in."""
    whole, _, part = name.rpartition("_")
    is_part = part.isascii() and part.isdecimal() and len(part) < 3
    return whole if is_part and 1 <= int(part) <= len(PARTS.get(whole, ())) else name
