"""Metadata of a sequence; `golden.json` stores the metadata of synthetic sequences."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from trackmark.datasets.interface import Origin, Sequence


@dataclass(frozen=True)
class SequenceMetadata:
    """Metadata of a sequence, as shown by `trackmark describe`.

    Attributes
    ----------
    name : str
        Canonical name.
    length : int
        Number of frames.
    size : tuple of int
        Width and height of the images [pixels].
    fps : float or None
        Frame rate [frames/s].
    present : int
        Number of frames in which the target is present; 0 without ground truth.
    annotated : int
        Number of frames for which the ground truth states box or absence; others are not scored.
    regions : list of str
        Names of further ground-truth boxes.
    attributes : mapping of str to int
        Number of frames with an event (`occlusion`, …), for events that occur.
    truth_source : str
        File or generator of the ground truth.
    n_unread_images : int
        Number of images after the last ground-truth row; they are not read.
    fingerprint : str
        See `Sequence.fingerprint`.
    remarks : tuple of str
        See `Sequence.remarks`.
    truth_missing : str
        Reason why a file that looks like ground truth was not read, or an empty text.
    origin : Origin
        Provenance of recorded data.
    """

    name: str
    length: int
    size: tuple[int, int]
    fps: float | None
    present: int
    annotated: int
    regions: list[str]
    attributes: Mapping[str, int]
    truth_source: str
    n_unread_images: int
    fingerprint: str
    remarks: tuple[str, ...] = ()
    truth_missing: str = ""
    origin: Origin = field(default_factory=Origin)


def stored_metadata(sequence: Sequence) -> dict[str, Any]:
    """Return the fields of `SequenceMetadata` that `golden.json` stores, as JSON values."""
    return {
        "fps": sequence.fps,
        "present": int(sequence.present.sum()),
        "regions": list(sequence.regions),
        "attributes": {
            name: int(flags.sum()) for name, flags in sequence.attributes.items() if flags.any()
        },
    }


def sequence_metadata(sequence: Sequence, size: tuple[int, int] | None = None) -> SequenceMetadata:
    """Return the metadata of an opened sequence; without `size`, the first image is read."""
    if size is None:
        height, width = sequence[0].shape[:2]
        size = width, height
    return SequenceMetadata(
        name=sequence.name,
        length=len(sequence),
        size=size,
        annotated=int(sequence.annotated.sum()),
        truth_source=sequence.truth_source,
        truth_missing=sequence.truth_missing,
        n_unread_images=sequence.n_unread_images,
        fingerprint=sequence.fingerprint,
        remarks=tuple(sequence.remarks),
        origin=sequence.origin,
        **stored_metadata(sequence),
    )
