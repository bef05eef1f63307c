"""Truth of a target's scene in closed form: no picture is needed."""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.plain.motion import COLUMNS, TargetMotion, columns_of_silhouette
from trackmark.datasets.synthetic.scene import Truth

CHUNK = 1024  # frames measured at once: memory stays flat in the length


def target_truth(motion: TargetMotion) -> Truth:
    """Boxes, visibility and attributes of all frames.

    Attributes are `occlusion` (the board hides some of the target), `out_of_view` (some or
    all of it), `scale_change` (outside 0.8 to 1.25 of the first size), `light_change` (at
    least a tenth of the light is gone in the picture's middle) and `clutter` (a
    distractor's centre within twice the target's larger side of its centre).
    """
    times = np.arange(motion.knobs.length)
    scale = motion.scale(times)
    half = motion.half_size * scale[:, None]
    centre = motion.centre(times)
    boxes = np.concatenate([centre - half, 2 * half], axis=1)
    inside = (boxes[:, :2] >= 0).all(axis=1) & (centre + half <= motion.size).all(axis=1)
    in_view, visibility = np.ones(len(times)), np.ones(len(times))
    covered = np.zeros(len(times), np.bool_)
    if motion.board_width > 0:
        gap = np.abs(motion.board(times) - centre[:, 0])
        covered = gap < half[:, 0] + motion.board_width / 2
    partial = np.flatnonzero(covered | ~inside)
    for start in range(0, len(partial), CHUNK):
        chosen = partial[start : start + CHUNK]
        in_view[chosen], visibility[chosen] = _visible_fractions(
            motion, chosen, centre[chosen], half[chosen]
        )
    boxes[in_view == 0] = np.nan

    near = np.zeros(len(times), np.bool_)
    for path in motion.distractors:
        offset = np.abs(path.at(times) - centre)
        near |= (offset < 4 * half.max(axis=1)[:, None]).all(axis=1)
    present = in_view > 0
    return Truth(
        boxes,
        visibility,
        {
            "occlusion": present & (visibility < in_view),
            "out_of_view": np.logical_not(inside),
            "scale_change": (scale < 0.8) | (scale > 1.25),
            "light_change": motion.light(times, 0.0) <= 0.9,
            "clutter": near & present,
        },
    )


def _visible_fractions(
    motion: TargetMotion,
    frames: NDArray[np.int64],
    centre: NDArray[np.float64],
    half: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fractions of the silhouette in view, and of these not behind the board; column by column."""
    x, chord = columns_of_silhouette(motion.power)
    left = centre[:, :1] + half[:, :1] * (x - 1 / COLUMNS)
    right = centre[:, :1] + half[:, :1] * (x + 1 / COLUMNS)
    column = right - left
    top = np.maximum(centre[:, 1:] - half[:, 1:] * chord, 0)
    bottom = np.minimum(centre[:, 1:] + half[:, 1:] * chord, motion.size[1])
    height = np.maximum(bottom - top, 0)
    left, right = np.clip(left, 0, motion.size[0]), np.clip(right, 0, motion.size[0])
    whole = (2 * half[:, 1:] * chord * column).sum(axis=1)
    in_view = ((right - left) * height).sum(axis=1)
    middle = motion.board(frames)[:, None]
    first, last = middle - motion.board_width / 2, middle + motion.board_width / 2
    behind = np.maximum(np.minimum(right, last) - np.maximum(left, first), 0)
    hidden = (behind * height).sum(axis=1)
    return in_view / whole, np.clip((in_view - hidden) / whole, 0, 1)
