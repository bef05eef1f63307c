"""Centre location error of boxes [px] and centre-inside test; boxes have shape (n, 4)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.metrics.overlap import is_well_formed

MAX_CENTRE_ERROR = 1e100
"""Largest finite centre error [px]. Sums and squares of larger errors would overflow."""


@np.errstate(over="ignore", invalid="ignore")  # coordinates of 1e308
def centres(boxes: ArrayLike) -> NDArray[np.float64]:
    """Return the centres (x, y) of boxes, shape (n, 2), in pixels.

    >>> centres([[10, 20, 4, 6]])
    array([[12., 23.]])
    """
    b = np.asarray(boxes, np.float64, order="F").reshape(-1, 4)
    return b[:, :2] + b[:, 2:] / 2


@np.errstate(over="ignore", invalid="ignore")  # coordinates of 1e308
def centre_error(truth: ArrayLike, estimate: ArrayLike) -> NDArray[np.float64]:
    """Return the Euclidean distance of the box centres in each row [px], shape (n,).

    The distance is NaN if the target is absent. It is infinite, a miss at every threshold, if the
    estimate is malformed or the distance is above `MAX_CENTRE_ERROR`.
    """
    t = np.asarray(truth, np.float64, order="F").reshape(-1, 4)
    e = np.asarray(estimate, np.float64, order="F").reshape(-1, 4)
    difference = t[:, :2] + t[:, 2:] / 2 - (e[:, :2] + e[:, 2:] / 2)
    distance = np.hypot(difference[:, 0], difference[:, 1])
    distance[~(is_well_formed(e) & (distance <= MAX_CENTRE_ERROR))] = np.inf
    distance[np.isnan(t).any(axis=1)] = np.nan
    return np.asarray(distance)


def centre_inside(truth: ArrayLike, estimate: ArrayLike) -> NDArray[np.bool_]:
    """Return whether the estimate's centre lies inside the ground-truth box, by row, shape (n,).

    The left and top edges belong to the box, the right and bottom edges do not. The result is False
    if the target is absent or the estimate is malformed.
    """
    t = np.asarray(truth, np.float64, order="F").reshape(-1, 4)
    e = np.asarray(estimate, np.float64, order="F").reshape(-1, 4)
    low, high, centre = t[:, :2], t[:, :2] + t[:, 2:], centres(e)
    inside = ((low <= centre) & (centre < high)).all(axis=1)
    return np.asarray(inside & is_well_formed(e))
