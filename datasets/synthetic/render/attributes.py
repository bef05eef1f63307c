"""What happens to a target when: attributes of truth that scenes of several suites have."""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.views import FRAMES_PER_SECOND, SIZE

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

OCCLUDED = 0.9
"""Visible fraction below which a target counts as occluded."""

SMALLER, LARGER = 0.8, 1.25
"""Sizes outside these count as another scale [first size]."""

HALF_A_SECOND = round(FRAMES_PER_SECOND) // 2


def occluded(visibility: Array) -> Flags:
    """Where less than 0.9 of the target is seen."""
    return np.less(visibility, OCCLUDED)


def out_of_view(boxes: Array) -> Flags:
    """Where a part of a box, shape (n, 4), is beyond the picture's borders."""
    inside = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] <= SIZE).all(axis=1)
    return np.asarray(~inside)


def rescaled(sizes: Array, first: int = 0) -> Flags:
    """Where a size is outside 0.8 to 1.25 of what it is in the first frame that counts."""
    size: Array = sizes / sizes[first]
    return np.logical_or(size < SMALLER, size > LARGER)


def turning(headings: Array, degrees: float) -> Flags:
    """Where headings [radians] change by more than some degrees within a second."""
    padded = np.pad(headings, HALF_A_SECOND, mode="edge")
    turned = np.abs(padded[2 * HALF_A_SECOND :] - padded[: len(headings)])
    return np.greater(turned, np.radians(degrees))
