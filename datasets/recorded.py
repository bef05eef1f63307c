"""Sequences of recorded data: choice of a target, ground truth, and a fingerprint of the files."""

import hashlib
from collections import abc
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import quote
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.interface import Array, Frames, Mask, Origin, Sequence, SequenceError
from trackmark.datasets.truth_file import GroundTruth

if TYPE_CHECKING:
    from trackmark.datasets.shapes import Shapes

_MAX_LISTED = 20  # maximum number of values of an option in a description or message


@dataclass(frozen=True)
class Choice:
    """Option of recorded data that selects one of several values; without values, there is none."""

    name: str = ""
    values: abc.Sequence[str] = ()
    default: str = ""
    remark: str = ""
    # whether each value is a sequence of the benchmark, as targets are and modalities are not
    is_target: bool = True

    def description(self) -> dict[str, Any]:
        """Return the description of the option; see `datasets.options`."""
        default = int(self.default) if self.default.isdecimal() else self.default
        meaning = f"selected {self.name}, one of {self._listed()}{self.remark}"
        return {"name": self.name, "default": default, "meaning": meaning}

    def selected(self, path: Path, options: Mapping[str, str]) -> str:
        """Return the value of this option, the only valid one.

        Raises `SequenceError` naming the path for another option or value.
        """
        for unknown in sorted(options.keys() - {self.name}):
            valid = self.name or "none"
            raise SequenceError(f"{path}: unknown option {quote(unknown)}. Options: {valid}.")
        value = options[self.name]
        if value not in self.values:
            raise SequenceError(
                f"{path}: there is no {self.name} {quote(value)}. Values: {self._listed()}."
            )
        return value

    def targets(self, path: Path) -> dict[str, Path]:
        """Return one path per target by value; empty without several targets."""
        path = path if path.name else path.resolve()  # `.` has no name
        values = self.values if self.is_target and len(self.values) > 1 else ()
        return {value: path.with_name(f"{path.name}:{self.name}={value}") for value in values}

    def _listed(self) -> str:
        ellipsis = ", …" if len(self.values) > _MAX_LISTED else ""
        return ", ".join(self.values[:_MAX_LISTED]) + ellipsis


def recorded(
    name: str,
    images: list[Path] | Path,
    truth: GroundTruth | None,
    truth_source: Path | None,
    truth_missing: str = "",
    *,
    fps: float | None = None,
    attributes: Mapping[str, NDArray[np.bool_]] | None = None,
    masks: Callable[[int], Mask | None] | None = None,
    shapes: "Shapes | None" = None,
    frame_values: Mapping[str, Array] | None = None,
    image_size: tuple[int, int] | None = None,
    description: str = "",
    further_files: abc.Sequence[Path] = (),
) -> Sequence:
    """Return the sequence of image files or of a video.

    Boxes without a positive size are malformed: see `Sequence`. If the ground truth has only one
    row, as in test sets, the sequence has all images, and the other frames are not annotated.
    Otherwise the last row ends the sequence.

    Parameters
    ----------
    name : str
        Canonical name.
    images : list of Path or Path
        One file per frame, or a video, which has its own frame rate.
    truth : GroundTruth or None
        Ground truth.
    truth_source : Path or None
        File of the ground truth.
    description : str
        See `Origin`.
    further_files : sequence of Path
        Other files that belong to the fingerprint, such as masks.
    truth_missing, fps, attributes, masks, shapes, frame_values, image_size
        See `Sequence`.
    """
    frames: Frames
    if isinstance(images, list):
        frames, files, frame_names = ImageFiles(images), images, [file.name for file in images]
    else:
        # imported here, because it loads a video decoder
        from trackmark.datasets.video_frames import VideoFrames

        frames, files, frame_names = VideoFrames(images), [images], None
        fps = frames.fps
    if truth is not None:
        stated = np.flatnonzero(truth.annotated_frames)
        if len(stated) == 1 and stated[0] == len(truth.boxes) - 1:
            truth = _with_all_frames(truth, len(frames))
    n = len(frames if truth is None else truth.boxes)
    # Image files after the last ground-truth row are never read.
    read = files[:n]

    boxes, malformed = (None, None) if truth is None else _split_malformed(truth.boxes)

    sequence = Sequence(
        name,
        frames,
        boxes,
        malformed=malformed,
        fingerprint=lambda: _fingerprint(sequence, file_digests([*read, *further_files])),
        annotated=None if truth is None else truth.annotated_frames,
        visibility=None if truth is None else truth.visibility,
        attributes={key: _extended(x, n, fill=False) for key, x in (attributes or {}).items()},
        fps=fps,
        masks=masks,
        shapes=None if shapes is None else shapes.extended(n),
        frame_names=frame_names,
        truth_source=str(truth_source or ""),
        truth_missing=truth_missing,
        frame_values={key: _extended(x, n, 0.0) for key, x in (frame_values or {}).items()},
        image_size=image_size,
        origin=Origin(description=description),
    )
    return sequence


def _split_malformed(boxes: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return boxes with NaN rows in place of malformed ones, and the flags of the latter.

    Malformed rows are finite boxes without a positive size, except in the first row:
    `Sequence.check_runnable` refuses that one.
    """
    finite, sizeless = np.isfinite(boxes).all(axis=1), (boxes[:, 2:] <= 0.0).any(axis=1)
    malformed = finite & sizeless & (np.arange(len(boxes)) > 0)
    return np.where(malformed[:, None], np.nan, boxes), malformed


def _with_all_frames(truth: GroundTruth, n: int) -> GroundTruth:
    """Return the ground truth of n frames, of which those after the last row are not annotated."""
    visibility = truth.visibility
    return GroundTruth(
        _extended(truth.boxes, n, np.nan),
        None if visibility is None else _extended(visibility, n, np.nan),
        annotated=_extended(truth.annotated_frames, n, fill=False),
    )


def _extended(values: NDArray[Any], n: int, fill: float) -> NDArray[Any]:
    """Return values by frame, extended to n frames by rows with the value `fill`."""
    further = np.full((max(n - len(values), 0), *values.shape[1:]), fill, values.dtype)
    return np.concatenate([values, further])


def _fingerprint(sequence: Sequence, digests: abc.Sequence[str]) -> str:
    """Return a digest of a sequence's ground truth and of its files' digests."""
    digest = hashlib.sha256()
    for values in (sequence.boxes, sequence.visibility):
        # Adding 0 turns -0 into 0, so that equal values have equal bytes.
        digest.update((values + 0.0).astype("<f8").tobytes() + b"\0")
    # Without truth nothing is annotated; that is no statement of the ground truth.
    if 0 < sequence.annotated.sum() < len(sequence):
        digest.update(b"annotated\0" + sequence.annotated.tobytes())
    if sequence.malformed.any():
        digest.update(b"malformed\0" + sequence.malformed.tobytes())
    for tag, flags in sorted(sequence.attributes.items()):
        digest.update(tag.encode() + b"\0" + flags.tobytes())
    for file_digest in digests:
        digest.update(file_digest.encode())
    return digest.hexdigest()
