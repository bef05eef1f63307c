"""Video files with ground truth in a CSV file."""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.interface import Sequence
from trackmark.datasets.recorded import recorded

SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".webm", ".mpg")


def recognises(path: Path) -> bool:
    """Return whether the path is a file with the suffix of a video."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the file; without `truth`, a `.csv` of the same name is read if it exists."""
    return recorded(
        path.resolve().name,
        path,
        *truth_file.read_given_or_default(truth, path.with_suffix(".csv")),
        truth_missing=truth_file.unread_file_hint(path.with_suffix(".csv"), path.stem),
    )
