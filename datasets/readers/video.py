"""Video files with ground truth in a CSV file."""

from pathlib import Path

from trackmark.datasets.interface import Sequence
from trackmark.datasets.recorded import recorded
from trackmark.datasets.truth_file import read_given_or_default

SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".webm", ".mpg")


def recognises(path: Path) -> bool:
    """Return whether the path is a file with the suffix of a video."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the file; without `truth`, a `.csv` of the same name is read if it exists."""
    ground_truth = read_given_or_default(truth, path.with_suffix(".csv"), path.stem)
    return recorded(path.resolve().name, path, *ground_truth)
