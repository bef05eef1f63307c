"""Overlap of boxes.

Conventions: boxes are `[x, y, width, height]` in continuous pixels; no pixel is added or
rounded away, so a perfect estimate overlaps by exactly 1.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


@np.errstate(over="ignore", invalid="ignore")  # boxes of 1e308: an infinite area is right
def overlap(truth: ArrayLike, estimate: ArrayLike) -> NDArray[np.float64]:
    r"""Intersection over union of boxes, row by row.

    .. math:: |T \cap E| \,/\, |T \cup E|

    Parameters
    ----------
    truth, estimate : array of float64, shape (n, 4)
        Boxes in pixels.

    Returns
    -------
    ndarray of float64, shape (n,)
        In [0, 1]. NaN where the truth is absent (a NaN row); 0 where the estimate is
        malformed (not finite, or without positive size).

    Examples
    --------
    >>> overlap([[0, 0, 10, 10]], [[5, 0, 10, 10]]).round(3)
    array([0.333])
    """
    t = np.asarray(truth, np.float64).reshape(-1, 4)
    e = np.asarray(estimate, np.float64).reshape(-1, 4)
    good = is_well_formed(e)
    # A malformed box becomes an empty one: it overlaps nothing.
    e = np.where(good[:, None], e, 0.0)
    low = np.maximum(t[:, :2], e[:, :2])
    # Sizes are differences of the same corners that the intersection is made of, so that
    # equal boxes give equal areas to the bit.
    t_size = (t[:, :2] + t[:, 2:]) - t[:, :2]
    e_size = (e[:, :2] + e[:, 2:]) - e[:, :2]
    high = np.minimum(t[:, :2] + t[:, 2:], e[:, :2] + e[:, 2:])
    intersection = np.prod(np.maximum(0.0, high - low), axis=1)
    union = np.prod(t_size, axis=1) + np.prod(e_size, axis=1) - intersection
    absent = np.isnan(t).any(axis=1)
    shared = np.divide(intersection, union, out=np.zeros_like(union), where=union > 0)
    return np.where(absent, np.nan, np.clip(shared, 0.0, 1.0))


def is_well_formed(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which boxes are finite with positive width and height, shape (n,)."""
    return np.asarray(np.isfinite(boxes).all(axis=1) & (boxes[:, 2:] > 0).all(axis=1))
