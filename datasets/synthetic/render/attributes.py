"""Ground-truth attributes that several suites use."""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.views import FRAMES_PER_SECOND, SIZE

Flags = NDArray[np.bool_]

OCCLUDED = 0.9  # A target counts as occluded if its visible fraction is below this value

# sizes outside this range count as a change of scale [relative to the first size]
SMALLER, LARGER = 0.8, 1.25

HALF_A_SECOND = round(FRAMES_PER_SECOND) // 2


def occluded(visibility: Array) -> Flags:
    """Return for every frame whether less than 0.9 of the target is visible."""
    return np.less(visibility, OCCLUDED)


def out_of_view(boxes: Array) -> Flags:
    """Return for each of `boxes`, shape (n, 4), whether a part of it is outside the image."""
    inside = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] <= SIZE).all(axis=1)
    return np.asarray(~inside)


def rescaled(sizes: Array, first: int = 0) -> Flags:
    """Return for every frame whether the size is outside 0.8 to 1.25 times the size in `first`."""
    size: Array = sizes / sizes[first]
    return np.logical_or(size < SMALLER, size > LARGER)


def turning(headings: Array, degrees: float) -> Flags:
    """Return for every frame whether headings [radians] change by over `degrees` per second."""
    padded = np.pad(headings, HALF_A_SECOND, mode="edge")
    turned = np.abs(padded[2 * HALF_A_SECOND :] - padded[: len(headings)])
    return np.greater(turned, np.radians(degrees))
