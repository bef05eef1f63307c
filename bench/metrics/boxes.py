"""Overlap and centre error of boxes `[x, y, width, height]`, in continuous pixels."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

MAX_CENTRE_ERROR = 1e100
"""Largest finite centre error [px]. Sums and squares of larger errors would overflow."""


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # coordinates of 1e308, empty boxes
def overlap(truth: ArrayLike, estimate: ArrayLike) -> NDArray[np.float64]:
    """Return the intersection over union of boxes, shape (n, 4), by row: shape (n,) in [0, 1].

    The overlap is NaN if the target is absent (a NaN row). It is 0 if the estimate is malformed
    (not finite or without positive size), and exactly 1 for equal boxes.

    >>> overlap([[0, 0, 10, 10]], [[5, 0, 10, 10]]).round(3)
    array([0.333])
    """
    # Column-major order, as NumPy is slow along rows of four numbers.
    t = np.asarray(truth, np.float64, order="F").reshape(-1, 4)
    e = np.asarray(estimate, np.float64, order="F").reshape(-1, 4)
    t_low, t_high = t[:, :2], t[:, :2] + t[:, 2:]
    e_low, e_high = e[:, :2], e[:, :2] + e[:, 2:]
    # Sizes are computed from the corners of the intersection, so that equal boxes have equal areas
    # to the bit.
    common = np.maximum(0.0, np.minimum(t_high, e_high) - np.maximum(t_low, e_low))
    t_size, e_size = t_high - t_low, e_high - e_low
    intersection = common[:, 0] * common[:, 1]
    union = t_size[:, 0] * t_size[:, 1] + e_size[:, 0] * e_size[:, 1] - intersection
    shared = np.minimum(intersection / union, 1.0)
    # A malformed estimate has no intersection, or a union that is not a positive number.
    shared[~(union > 0)] = 0.0
    shared[np.isnan(t).any(axis=1)] = np.nan
    return np.asarray(shared)


def is_well_formed(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which boxes are finite with positive width and height, shape (n,)."""
    well_formed = np.isfinite(boxes)
    well_formed[:, 2:] &= boxes[:, 2:] > 0
    return np.asarray(well_formed.all(axis=1))


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
