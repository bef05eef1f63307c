"""Filters of time, and functions for all filters: change a sequence, create a generator."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Sequence, SequenceError

MIN_FRAMES = 20  # minimum number of frames that the filter `start` must leave


class _ComputedFrames:
    """Frames that are computed by a function of the frame number."""

    def __init__(self, count: int, image: Callable[[int], Image]) -> None:
        self._count, self._image = count, image

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frame: int) -> Image:
        return self._image(frame)


def with_changes(
    sequence: Sequence, image: Callable[[int], Image] | None = None, **changes: Any
) -> Sequence:
    """Return a sequence with a new function for images, and changed arguments of `Sequence`."""
    boxes = changes.setdefault("boxes", sequence.boxes)
    unchanged: dict[str, Any] = {
        "name": sequence.name,
        "fingerprint": "",
        "annotated": sequence.annotated,
        "malformed": sequence.malformed,
        "regions": sequence.regions,
        "visibility": sequence.visibility,
        "attributes": sequence.attributes,
        "fps": sequence.fps,
        "masks": sequence.mask,
        "frame_names": [sequence.frame_name(frame) for frame in range(len(sequence))],
        "truth_source": sequence.truth_source,
        "truth_missing": sequence.truth_missing,
        "image_size": sequence.known_size,
        "origin": sequence.origin,
    }
    frames = _ComputedFrames(len(boxes), image or (lambda frame: sequence[frame].copy()))
    return Sequence(frames=frames, **(unchanged | changes))


def generator(draw: int, *key: int) -> np.random.Generator:
    """Return a random generator that depends on `draw`, but not on the value of the filter."""
    return np.random.default_rng(np.random.SeedSequence(draw, spawn_key=key))


def start(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Start at a later frame."""
    first = int(value)
    if len(sequence) - first < MIN_FRAMES:
        raise SequenceError(
            f"{sequence.name}: filter.start={first} leaves {len(sequence) - first} of "
            f"{len(sequence)} frames. At least {MIN_FRAMES} must be left."
        )
    return _reordered(sequence, np.arange(first, len(sequence)))


def step(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Show every nth frame, repeatedly forwards and backwards, up to the original length."""
    forwards = np.arange(0, len(sequence), int(value))
    if len(forwards) < 2:
        raise SequenceError(
            f"{sequence.name}: filter.step={int(value)} leaves only the first of {len(sequence)} "
            "frames. Use a smaller step."
        )
    frames = np.concatenate([forwards, forwards[-2:0:-1]])
    return _reordered(sequence, np.resize(frames, len(sequence)))


def _reordered(sequence: Sequence, frames: NDArray[np.int64]) -> Sequence:
    """Return the sequence of the given frames in this order; a frame may repeat."""
    order = frames.tolist()
    return with_changes(
        sequence,
        lambda frame: sequence[order[frame]].copy(),
        boxes=sequence.boxes[frames],
        annotated=sequence.annotated[frames],
        malformed=sequence.malformed[frames],
        regions={name: rows[frames] for name, rows in sequence.regions.items()},
        visibility=sequence.visibility[frames],
        attributes={name: flags[frames] for name, flags in sequence.attributes.items()},
        masks=lambda frame: sequence.mask(order[frame]),
        frame_names=[sequence.frame_name(frame) for frame in order],
    )
