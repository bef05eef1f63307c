"""Folders of images, in the natural order of their names."""

from pathlib import Path

from trackmark.datasets.image_files import check_frame_numbers, image_files
from trackmark.datasets.interface import Sequence
from trackmark.datasets.recorded import recorded
from trackmark.datasets.truth_file import read_given_or_default


def recognises(path: Path) -> bool:
    """Return whether the path is a folder that contains images."""
    return path.is_dir() and bool(image_files(path))


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the folder; without `truth`, its `truth.csv` is read if it exists."""
    files = image_files(path)
    check_frame_numbers(files)
    return recorded(path.resolve().name, files, *read_given_or_default(truth, path / "truth.csv"))
