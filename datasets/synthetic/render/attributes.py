"""Ground-truth attributes that scenes of several suites share."""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.views import FRAMES_PER_SECOND, SIZE

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

OCCLUDED = 0.9
"""Visible share below which a target counts as occluded."""

SMALLER, LARGER = 0.8, 1.25
"""Sizes outside these bounds count as another scale [first size]."""

HALF_A_SECOND = round(FRAMES_PER_SECOND) // 2


def occluded(visibility: Array) -> Flags:
    """Return the frames in which less than 0.9 of the target is visible."""
    return np.less(visibility, OCCLUDED)


def out_of_view(boxes: Array) -> Flags:
    """Return the frames in which a box, shape (n, 4), exceeds the image borders."""
    inside = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] <= SIZE).all(axis=1)
    return np.asarray(~inside)


def rescaled(sizes: Array, first: int = 0) -> Flags:
    """Return the frames with a size outside 0.8 to 1.25 of that in the reference frame `first`."""
    size: Array = sizes / sizes[first]
    return np.logical_or(size < SMALLER, size > LARGER)


def turning(headings: Array, degrees: float) -> Flags:
    """Return the frames in which headings [radians] change by more than `degrees` in a second."""
    padded = np.pad(headings, HALF_A_SECOND, mode="edge")
    turned = np.abs(padded[2 * HALF_A_SECOND :] - padded[: len(headings)])
    return np.greater(turned, np.radians(degrees))
