"""The tracker's template kept on a target, without what it does about severe occlusions.

And what is done to the target, on frames of a scene in which it is wholly seen, so that it is known
what it truly looks like.
"""

from collections.abc import Callable, Iterable
from itertools import product
from math import floor, nan
from typing import Any, NamedTuple

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.scenes import turned_about
from datasets import Sequence, SequenceError
from trackers.base.interface import Box, Image, Mask
from trackers.nguyen2002 import Nguyen2002
from trackers.templates.appearance import Appearance, Features, Seen
from trackers.templates.matching import Match, Pose, Window, sampled
from trackers.templates.occlusion import Occlusion

__all__ = ["COLOURS", "FEATURES", "Follower", "Patch", "View", "clear_frames", "few", "mask_in"]
__all__ += ["pale", "tried", "true_pose", "turned", "wholly_seen"]

Array = NDArray[np.float64]

FEATURES: tuple[Features, ...] = ("intensity", "rgb", "invariants", "arctan")
COLOURS: tuple[Features, ...] = ("rgb", "invariants")
"""Those of the tracker, and in a quick look."""

LESS = 0.01
"""Visible share by which a target that is wholly seen differs from when it is seen best.

What holds it may hide a part of it from beginning to end.
"""

TALLER = 1.25
"""Height of a patch that is slid over the target, over the target's."""

FAINT, PALE = 0.4, 100.0
"""What is left of contrast, and the darkest grey level, of an image that is made pale."""


class View(NamedTuple):
    """A template's place in a frame, at what cost it was matched, and how its pixels compare."""

    pose: Pose
    cost: float
    seen: Seen


class Follower(Nguyen2002):
    """The tracker taken apart: whoever asks decides which views are taken into the template.

    The tracker itself takes those with no more than γ outliers. It begins in a BGR image with the
    target's box; its parameters are those of `as-written`, but for what is given.
    """

    def __init__(
        self, image: Image, box: Box, features: Features = "invariants", **parameters: Any
    ) -> None:
        chosen = {**self.presets["as-written"], "features": features, **parameters}
        super().__init__(self.Parameters(**chosen), np.random.SeedSequence(0))
        self.init(image, box)
        self._first_box, self._taken = box, False

    @property
    def appearance(self) -> Appearance:
        """Template and covariances."""
        return self._appearance

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the template."""
        return self._height, self._width

    def restart(self, image: Image, box: Box) -> None:
        """Take the target anew from where it is, at rest."""
        self._begin(image, true_pose(self._first_box, box), (0.0, 0.0, 0.0))

    def restart_after(self, image: Image, pose: Pose, frames: int) -> None:
        """Take it anew so many frames after the last that was taken, moving as it did since."""
        x, y, scale = ((b - a) / frames for a, b in zip(self._pose, pose, strict=True))
        self._begin(image, pose, (x, y, scale))

    def look(self, image: Image, hidden: int = 0) -> View:
        """Match the template with a frame, so many after the first that was not taken."""
        if hidden:
            x, y, _ = self._smoothers
            away = Occlusion(0, self._pose, (x.velocity, y.velocity))
            found = self._examined(away, image, hidden).match
        else:
            around = Pose(*(smoother.predicted() for smoother in self._smoothers))
            found = self.match(image, around, self.parameters.search_range)
        return self.compare(image, found.pose, found.cost)

    def match(self, image: Image, around: Pose, search_range: int) -> Match:
        """Where the template fits best in a part of an image (equation 4)."""
        return self._match(image, around, search_range)[0]

    def compare(self, image: Image, pose: Pose, cost: float = nan) -> View:
        """Compare the template with a frame at a place, and at what cost it is there if known."""
        window = self._window(image, pose, 0)
        features = sampled(window, pose, *self.shape, self.parameters.subpixel)
        if not self._appearance.started:
            self._appearance.start(features)
        return View(pose, cost, self._appearance.seen(features))

    def take(self, view: View) -> None:
        """Update the template by a view of the next frame."""
        self._take(view.pose, view.seen, first=not self._taken)
        self._taken = True

    def box(self, pose: Pose) -> Box:
        """Box of a pose [pixels]."""
        return self._box(pose)

    def truth(self, image: Image, box: Box) -> Array:
        """Features of the target where it truly is, shape (height, width, d)."""
        return self._view(image, true_pose(self._first_box, box))

    def errors(self, image: Image, box: Box) -> Array:
        """|g - truth| of the template's pixels, shape (height, width): means over the components.

        Each in standard deviations of the true component over the template. Asked of the next
        frame, the truth's noise is not what was taken into the template.
        """
        truth = self.truth(image, box)
        spread = np.maximum(truth.std(axis=(0, 1)), 1e-9)
        return np.asarray((np.abs(self.appearance.template - truth) / spread).mean(axis=2))

    def on_template(self, mask: Mask, box: Box) -> Mask:
        """What a mask of the image says of the template's pixels, the target being in a box."""
        rows, columns = mask.shape
        window = Window(mask[:, :, np.newaxis].astype(np.float64), 0, 0, rows, columns)
        return sampled(window, true_pose(self._first_box, box), *self.shape, False)[:, :, 0] > 0

    def _begin(self, image: Image, pose: Pose, velocity: tuple[float, float, float]) -> None:
        self._pose, self._taken = pose, False
        self._appearance = Appearance(self._noise, self._view(image, pose))
        self._restart(pose, velocity)


def true_pose(first: Box, box: Box) -> Pose:
    """Pose of a template of the first box that covers another, whose shape is the same."""
    x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
    return Pose(x, y, float(box[2] / first[2]))


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


def turned(image: Image, box: Box, degrees: float) -> Image:
    """Turned about the middle of a box."""
    return turned_about(image, box[:2] + box[2:] / 2, degrees, cv2.INTER_LINEAR)
