"""Shares of frames by threshold: success by overlap, precision by distance."""

import numpy as np
from numpy.typing import NDArray

OVERLAPS = np.linspace(0, 1, 21)
"""Thresholds of overlap of the OTB family."""

DISTANCES = np.arange(51.0)
"""Thresholds of the centre error of the OTB family [px]."""

NORMALISED_DISTANCES = np.arange(51) / 100
"""Thresholds of the centre error in widths and heights of the target."""


def shares(
    values: NDArray[np.float64], thresholds: NDArray[np.float64], *, above: bool = False
) -> NDArray[np.float64]:
    """Return the curve of the share of values up to, or above, each threshold.

    It has points (threshold, share), shape (thresholds, 2). NaN is no hit. Shares of no values are
    NaN.
    """
    ordered = np.sort(values)  # NaN last
    hits = ordered.searchsorted(thresholds, "right")
    if above:
        hits = ordered.searchsorted(np.nan) - hits
    return np.array([thresholds, hits / (len(values) or np.nan)]).T
