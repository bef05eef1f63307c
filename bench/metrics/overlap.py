"""Overlap of boxes `[x, y, width, height]` in continuous pixels, without rounding."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


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
