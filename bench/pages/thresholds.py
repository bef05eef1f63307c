"""Thresholds of the curves of success and precision, and the frames that are nearest to them."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
OVERLAPS = np.linspace(0.0, 1.0, 51)
ERRORS = np.linspace(0.0, 50.0, 51)
"""Thresholds of success [overlap] and precision [pixels]."""


def nearest_to(
    values: Array, thresholds: Array, frames: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Of every threshold, (k,), how far off the nearest of the values is, and its frame."""
    far = np.abs(np.nan_to_num(values, nan=np.inf)[:, None] - thresholds)
    chosen = np.argmin(far, axis=0)
    return far[chosen, np.arange(len(thresholds))], frames[chosen]
