"""What a description tells of a sequence; of rendered ones it is sealed, so that none is opened."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from trackmark.datasets.interface import Origin, Sequence


@dataclass(frozen=True)
class Outline:
    """What is known of a sequence."""

    name: str  # canonical name
    length: int  # number of frames
    size: tuple[int, int]  # width and height of the images [pixels]
    fps: float | None  # frames a second
    present: int  # frames in which the target is; 0 where there is no truth
    regions: list[str]  # names of further truths
    # frames in which something happens (`occlusion`, …); only what does happen
    attributes: Mapping[str, int]
    truth_source: str  # file or generator that the truth comes from
    images_beyond_truth: int  # images after the last row of the truth, which are not read
    fingerprint: str  # as `Sequence.fingerprint`
    truth_missing: str = ""  # why there is no truth, though a file looks like one; else empty
    origin: Origin = field(default_factory=Origin)  # where recorded data come from


def known_of(sequence: Sequence) -> dict[str, Any]:
    """What only the opened sequence tells, for its seal: fields of `Outline` that JSON can hold."""
    return {
        "fps": sequence.fps,
        "present": int(sequence.present.sum()),
        "regions": list(sequence.regions),
        "attributes": {
            name: int(flags.sum()) for name, flags in sequence.attributes.items() if flags.any()
        },
    }


def outlined(sequence: Sequence, size: tuple[int, int] | None = None) -> Outline:
    """Outline of an opened sequence; its first image is read where the size is not given."""
    if size is None:
        height, width = sequence[0].shape[:2]
        size = width, height
    return Outline(
        name=sequence.name,
        length=len(sequence),
        size=size,
        truth_source=sequence.truth_source,
        truth_missing=sequence.truth_missing,
        images_beyond_truth=sequence.images_beyond_truth,
        fingerprint=sequence.fingerprint,
        origin=sequence.origin,
        **known_of(sequence),
    )
