"""A video file, its truth in a CSV file."""

from pathlib import Path

from trackmark.datasets import truth_file
from trackmark.datasets.interface import Sequence
from trackmark.datasets.recorded import recorded

SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".webm", ".mpg")
EXPECTS = f"a video file ({', '.join(SUFFIXES)}), its truth in a .csv of the same name or given"
GENERAL = False
MARKS: tuple[str, ...] = ()


def recognises(path: Path) -> bool:
    """Whether it is a file with a video's suffix."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def read(path: Path, truth: Path | None) -> Sequence:
    """Open the file; without `truth`, a `.csv` of the same name beside it is taken."""
    from trackmark.datasets.video_frames import (
        VideoFrames,  # a decoder is loaded where a video is opened
    )

    frames = VideoFrames(path)
    return recorded(
        path.resolve().name,
        frames,
        [path],
        *truth_file.given_or_own(truth, path.with_suffix(".csv")),
        truth_missing=truth_file.missing(path.with_suffix(".csv"), path.stem),
        fps=frames.fps,
    )
