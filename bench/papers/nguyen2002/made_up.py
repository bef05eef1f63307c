"""Frames of a scene with something that we do to the target: what it looks like is then known."""

from collections.abc import Callable, Iterable
from itertools import product
from math import floor

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.nguyen2002.follower import FEATURES
from datasets import Sequence, SequenceError
from trackers.base.interface import Box, Image, Mask
from trackers.templates.appearance import Features

__all__ = ["Patch", "clear_frames", "dimmed", "few", "mask_in", "pale"]
__all__ += ["tried", "turned", "wholly_seen"]

LESS = 0.01
"""Visible share by which a target that is wholly seen differs from when it is seen best.

What holds it may hide a part of it from beginning to end.
"""

TALLER = 1.25
"""Height of a patch that is slid over the target, over the target's."""

FAINT, PALE = 0.4, 100.0
"""What is left of contrast, and the darkest grey level, of an image that is made pale."""


class Patch:
    """Something of a scene's ground, as large as the target, from where this is farthest away.

    It is taken from an image with the target's box in it.
    """

    def __init__(self, image: Image, box: Box) -> None:
        rows, columns = image.shape[:2]
        x, y, width, height = box.tolist()
        left = 0 if x + width / 2 > columns / 2 else columns - round(width)
        top = 0 if y + height / 2 > rows / 2 else rows - round(height)
        self._pixels = image[top : top + round(height), left : left + round(width)].copy()

    def slid_over(self, image: Image, box: Box, share: float) -> tuple[Image, Mask]:
        """An image with the patch over a share of the target's width from the left.

        And a mask of the pixels that show the patch, shape (rows, columns).
        """
        x, y, width, height = box.tolist()
        above = (TALLER - 1) / 2 * height
        there = np.array([x - (1 - share) * width, y - above, width, TALLER * height])
        return self.on(image, there, right_of=x)

    def stuck_on(self, image: Image, box: Box, part: Box) -> tuple[Image, Mask]:
        """An image with the patch on a part of the target, in shares of its box; and its mask."""
        size = box[2:]
        there = np.concatenate([box[:2] + part[:2] * size, part[2:] * size])
        return self.on(image, there)

    def on(self, image: Image, there: Box, right_of: float = -np.inf) -> tuple[Image, Mask]:
        """An image with the patch in a box, right of a column; and the mask of the patch."""
        rows, columns = image.shape[:2]
        # To the same side at every half, so that it keeps its place on the target.
        left, top = np.floor(there[:2] + 0.5).astype(int).tolist()
        right, bottom = np.floor(there[:2] + there[2:] + 0.5).astype(int).tolist()
        mask = np.zeros((rows, columns), np.bool_)
        begin = max(left, floor(max(right_of, 0.0) + 0.5))
        mask[max(top, 0) : max(bottom, 0), begin : max(right, begin)] = True
        pixels = cv2.resize(self._pixels, (right - left, bottom - top))
        shown = image.copy()
        down, across = np.nonzero(mask)
        shown[down, across] = pixels[down - top, across - left]
        return shown, mask


def clear_frames(sequence: Sequence, before: int = 0) -> NDArray[np.bool_]:
    """Frames in which as much of the target is seen as ever, and in so many before them, too.

    In all these the lamps are the same.
    """
    clear = np.asarray(sequence.visibility >= sequence.visibility.max() - LESS)
    lamp = sequence.attributes.get("lamp off", np.zeros(len(sequence), np.bool_))
    found = clear.copy()
    for step in range(1, before + 1):
        found[:step] = False
        found[step:] &= clear[:-step] & (lamp[step:] == lamp[:-step])
    return found


def wholly_seen(sequence: Sequence, least: int, most: int) -> Sequence | None:
    """The longest part of clear frames, at most so many of it; None where it has too few."""
    unbroken = clear_frames(sequence, 1)
    ends, begin, longest = np.flatnonzero(~unbroken).tolist() + [len(sequence)], 0, range(0)
    for end in ends:
        if end - begin > len(longest):
            longest = range(begin, end)
        begin = end
    if not clear_frames(sequence)[longest.start] or len(longest) < least:
        return None
    return sequence[longest.start : longest.start + min(len(longest), most)]


def few(quick: bool) -> tuple[Features, ...]:
    """Features that something is tried with."""
    return ("invariants",) if quick else FEATURES


def tried(
    table: str,
    sequence: Sequence,
    frames: int,
    course: Callable[..., dict[str, float]],
    chosen: tuple[Features, ...],
    **ways: Iterable[object],
) -> dict[str, pd.DataFrame]:
    """A table of what comes of a target in so many frames in which it is wholly seen.

    None where it has too few; else a row for each way (columns and their values, each with each):
    `course(part, features, *way)` gives its further columns.
    """
    part = wholly_seen(sequence, frames, frames)
    if part is None:
        return {}
    rows = [
        {"features": features, **dict(zip(ways, way, strict=True))} | course(part, features, *way)
        for features in chosen
        for way in product(*ways.values())
    ]
    return {table: pd.DataFrame(rows)}


def mask_in(sequence: Sequence, frame: int) -> Mask:
    """Pixels of the target; `SequenceError` where the sequence has no masks."""
    mask = sequence.mask(frame)
    if mask is None:
        raise SequenceError(f"{sequence.name}, {sequence.frame_name(frame)}: there is no mask.")
    return mask


def pale(image: Image) -> Image:
    """An image of little contrast, without anything dark."""
    return np.round(image * np.float32(FAINT) + np.float32(PALE)).astype(np.uint8)


def dimmed(image: Image, gain: float) -> Image:
    """In less light."""
    return np.round(image * np.float32(gain)).astype(np.uint8)


def turned(image: Image, box: Box, degrees: float) -> Image:
    """Turned about the middle of a box; beyond its rim the image is continued."""
    x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
    turn = cv2.getRotationMatrix2D((x, y), degrees, 1.0)
    size = image.shape[1], image.shape[0]
    found = cv2.warpAffine(image, turn, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(found, np.uint8)
