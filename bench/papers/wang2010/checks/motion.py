"""What moves in a scene, and how much of it a motion map finds."""

from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.papers.wang2010.plain import local_difference
from datasets import Sequence, SequenceError
from trackers.base.interface import Image, Mask

__all__ = ["averaged", "found", "latest", "moving_frames", "moving_things", "target_mask"]

Differences: TypeAlias = NDArray[np.float64]
Images: TypeAlias = tuple[Image, Image, Image]

SEEN = 16  # grey levels: a difference that no sensor's noise makes
LEAST_THING = 12  # pixels: smaller ones are noise, or edges that moved by a fraction
LEAST_CHANGED = 0.02  # of a thing's pixels, for one that moves


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


def moving_things(sequence: Sequence) -> NDArray[np.bool_]:
    """True mask of all that moves: the target, what holds it, and whoever comes with it.

    The target's mask is the sequence's own. What else moves is told by the empty ground,
    which under a camera at rest is the median of the frames: a thing is a connected piece of
    what differs from it and has changed since the frame before (or, in the first, by the next).

    Parameters
    ----------
    sequence : Sequence
        With masks, and a camera at rest.

    Returns
    -------
    ndarray of bool, shape (n, height, width)
        Where something moves.
    """
    images = np.stack([sequence[frame] for frame in range(len(sequence))])
    ground = np.median(images, axis=0).astype(np.uint8)
    masks = np.zeros(images.shape[:3], np.bool_)
    for frame in range(len(images)):
        differs = _differ(images[frame], ground)
        changed = _differ(images[frame], images[frame - 1 if frame else 1])
        target = target_mask(sequence, frame)
        count, things = cv2.connectedComponents((differs | target).astype(np.uint8))
        sizes = np.bincount(things.ravel(), minlength=count)
        moved = np.bincount(things[changed], minlength=count)
        moves = (sizes >= LEAST_THING) & (moved >= LEAST_CHANGED * sizes)
        moves[0] = False  # the ground
        masks[frame] = moves[things]
    return masks


def _differ(first: Image, second: Image) -> Mask:
    return np.asarray(cv2.absdiff(first, second).max(axis=2) >= SEEN)


def moving_frames(things: NDArray[np.bool_], most: int) -> list[int]:
    """At most so many frames in which something moves, evenly spaced, with two before them."""
    frames = np.flatnonzero(things.any(axis=(1, 2)))
    frames = frames[frames >= 2]
    if len(frames) == 0:
        return []
    chosen: list[int] = np.unique(
        frames[np.linspace(0, len(frames) - 1, most).round().astype(int)]
    ).tolist()
    return chosen


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
