"""What moves in a scene, and how much of it a motion map finds."""

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.papers.scenes import Remembered
from bench.papers.wang2010.checks.silhouettes import silhouettes
from bench.papers.wang2010.plain import local_difference
from datasets import Sequence, SequenceError
from trackers.base.interface import Image, Mask

__all__ = ["MovingThings", "averaged", "found", "latest", "target_mask"]

Differences: TypeAlias = NDArray[np.float64]
Images: TypeAlias = tuple[Image, Image, Image]


def target_mask(sequence: Sequence, frame: int) -> Mask:
    """Pixels that show the target.

    Raises
    ------
    SequenceError
        For a sequence without masks.
    """
    mask = sequence.mask(frame)
    if mask is None:
        raise SequenceError(
            f"{sequence.name}, {sequence.frame_name(frame)}: there is no mask of the target; "
            "what maps find of it can be measured on sequences with masks only."
        )
    return mask


class MovingThings:
    """True masks of all that moves, by frame.

    A thing moves in a frame in which its silhouette is not that of the frame before (in the
    first frame, that of the next).

    Parameters
    ----------
    sequence : Sequence
        Of a scene whose `silhouettes` are known, at least two frames.
    """

    def __init__(self, sequence: Sequence) -> None:
        frames = sequence.frames
        self._scene = frames.frames if isinstance(frames, Remembered) else frames
        self._length = len(sequence)
        self._seen: dict[int, list[Mask]] = {}

    def __getitem__(self, frame: int) -> Mask:
        now, other = self._things(frame), self._things(frame - 1 if frame else 1)
        moving = [thing for thing, was in zip(now, other, strict=True) if (thing != was).any()]
        return np.asarray(np.any([np.zeros_like(now[0]), *moving], axis=0))

    def swept(self, frames: Iterable[int]) -> Mask:
        """Where something moving is in one of these frames."""
        return np.asarray(np.any([self[frame] for frame in frames], axis=0))

    def frames(self, most: int) -> list[int]:
        """At most so many frames in which something moves, evenly spaced, with two before them."""
        spaced = np.unique(np.linspace(2, self._length - 1, most).round().astype(int)).tolist()
        return [frame for frame in spaced if self[frame].any()]

    def _things(self, frame: int) -> list[Mask]:
        if frame not in self._seen:
            self._seen[frame] = silhouettes(self._scene, frame)
        return self._seen[frame]


def latest(sequence: Sequence, frame: int) -> Images:
    """A frame and the two before it."""
    return sequence[frame], sequence[frame - 1], sequence[frame - 2]


def averaged(images: Images, window: int = 5) -> Differences:
    """Mean of the last two local differences, (D1 + D2) / 2, shape (height, width)."""
    image, previous, earlier = images
    last = local_difference(image, previous, window)
    before = local_difference(previous, earlier, window)
    return np.asarray((last + before) / 2, np.float64)


def found(moving: Mask, truth: Mask) -> dict[str, float]:
    """Recall, precision and F1 of a map of what moves; the precision of an empty map is 0."""
    hits = float(np.count_nonzero(moving & truth))
    in_map, in_truth = float(np.count_nonzero(moving)), float(np.count_nonzero(truth))
    return {
        "recall": hits / in_truth if in_truth else np.nan,
        "precision": hits / in_map if in_map else 0.0,
        "f1": 2 * hits / (in_map + in_truth) if in_map + in_truth else np.nan,
    }
