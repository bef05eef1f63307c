"""What all recorded sequences have in common: truth from a file, a fingerprint of files."""

import hashlib
from collections.abc import Callable, Mapping
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.interface import Frames, Mask, Origin, Sequence
from trackmark.datasets.shapes import Shapes
from trackmark.datasets.truth_file import GroundTruth


def recorded(
    name: str,
    frames: Frames,
    files: SequenceOf[Path],
    truth: GroundTruth | None,
    truth_source: Path | None,
    *,
    truth_missing: str = "",
    fps: float | None = None,
    frame_names: list[str] | None = None,
    attributes: Mapping[str, NDArray[np.bool_]] | None = None,
    masks: Callable[[int], Mask | None] | None = None,
    shapes: Shapes | None = None,
    values: Mapping[str, NDArray[np.float64]] | None = None,
    description: str = "",
    digests: Callable[[SequenceOf[Path]], list[str]] = file_digests,
) -> Sequence:
    """Sequence of recorded images.

    `name`: Canonical name. `frames`: The images. `files`: Files that hold them: one a frame, or one
    for all. `truth`: What is known of the target. `truth_source`: File that the truth comes from.
    `truth_missing, fps, frame_names, attributes, masks, shapes, values`: As for `Sequence`.
    `description`: As for `Origin`. `digests`: Gives the digests of the files that were read; those
    of masks must be among them.
    """
    boxes = None if truth is None else truth.boxes
    visibility = None if truth is None else truth.visibility
    # One file a frame: those of images beyond the truth are never read.
    read = files if boxes is None else files[: len(boxes)]

    sequence = Sequence(
        name,
        frames,
        boxes,
        fingerprint=lambda: _fingerprint(sequence, digests(read)),
        visibility=visibility,
        attributes=attributes,
        fps=fps,
        masks=masks,
        shapes=shapes,
        frame_names=frame_names,
        truth_source=str(truth_source or ""),
        truth_missing=truth_missing,
        values=values,
        origin=Origin(description=description),
    )
    return sequence


def recorded_images(
    name: str, images: list[Path], truth: GroundTruth | None, truth_source: Path | None, **more: Any
) -> Sequence:
    """Sequence of images in files, which are what its frames are known by; see `recorded`."""
    names = [file.name for file in images]
    frames = ImageFiles(images)
    return recorded(name, frames, images, truth, truth_source, frame_names=names, **more)


def _fingerprint(sequence: Sequence, digests: SequenceOf[str]) -> str:
    """Digest of what is true of a sequence, and of its files' digests."""
    digest = hashlib.sha256()
    for values in (sequence.boxes, sequence.visibility):
        # Adding 0 makes -0 the 0 that it equals.
        digest.update((values + 0.0).astype("<f8").tobytes() + b"\0")
    for tag, flags in sorted(sequence.attributes.items()):
        digest.update(tag.encode() + b"\0" + flags.tobytes())
    for file_digest in digests:
        digest.update(file_digest.encode())
    return digest.hexdigest()
