"""Filters of time, and what all filters are made of: a sequence with something changed."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Sequence, SequenceError

FEWEST = 20  # frames that must be left to be tracked


class _Shown:
    """Frames of a sequence, each as a function of its number gives it."""

    def __init__(self, count: int, image: Callable[[int], Image]) -> None:
        self._count, self._image = count, image

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frame: int) -> Image:
        return self._image(frame)


def changed(
    sequence: Sequence, image: Callable[[int], Image] | None = None, **new: Any
) -> Sequence:
    """The same sequence but for what is given: the image of a frame, arguments of `Sequence`."""
    boxes = new.setdefault("boxes", sequence.boxes)
    given: dict[str, Any] = {
        "name": sequence.name,
        "fingerprint": "",
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
    shown = image or (lambda frame: sequence[frame].copy())
    return Sequence(frames=_Shown(len(boxes), shown), **(given | new))


def generator(draw: int, *key: int) -> np.random.Generator:
    """Random numbers of a draw; the same for every value of a filter, so that values are pairs."""
    return np.random.default_rng(np.random.SeedSequence(draw, spawn_key=key))


def start(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Begin later."""
    first = int(value)
    if len(sequence) - first < FEWEST:
        raise SequenceError(
            f"{sequence.name}: it has {len(sequence)} frames, too few to begin at frame {first}: "
            f"at least {FEWEST} must be left."
        )
    return _reordered(sequence, np.arange(first, len(sequence)))


def step(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Show every so manyth frame, there and back, until there are as many as before."""
    way = np.arange(0, len(sequence), int(value))
    if len(way) < 2:
        raise SequenceError(
            f"{sequence.name}: of {len(sequence)} frames none is left but the first if only every "
            f"{int(value)}th is shown."
        )
    there_and_back = np.concatenate([way, way[-2:0:-1]])
    return _reordered(sequence, np.resize(there_and_back, len(sequence)))


def _reordered(sequence: Sequence, numbers: NDArray[np.int64]) -> Sequence:
    frames = numbers.tolist()
    return changed(
        sequence,
        lambda frame: sequence[frames[frame]].copy(),
        boxes=sequence.boxes[numbers],
        regions={name: rows[numbers] for name, rows in sequence.regions.items()},
        visibility=sequence.visibility[numbers],
        attributes={name: flags[numbers] for name, flags in sequence.attributes.items()},
        masks=lambda frame: sequence.mask(frames[frame]),
        frame_names=[sequence.frame_name(frame) for frame in frames],
    )
