"""Shares of frames by threshold: success by overlap, precision by centre error."""

import numpy as np
from numpy.typing import NDArray

OVERLAPS = np.linspace(0, 1, 21)
"""Overlap thresholds of OTB and LaSOT."""

DISTANCES = np.arange(51.0)
"""Centre error thresholds of OTB and LaSOT [px]."""

NORMALISED_DISTANCES = np.arange(51) / 100
"""Centre error thresholds of LaSOT, in widths and heights of the target."""


def share_curve(
    values: NDArray[np.float64], thresholds: NDArray[np.float64], *, above: bool = False
) -> NDArray[np.float64]:
    """Return the share of values at or below each threshold; if `above`, the share above it.

    The result has points (threshold, share), shape (thresholds, 2). NaN values are never counted.
    All shares are NaN if there are no values.
    """
    ordered = np.sort(values)  # NaN values last
    counts = ordered.searchsorted(thresholds, "right")
    if above:
        counts = ordered.searchsorted(np.nan) - counts
    return np.array([thresholds, counts / (len(values) or np.nan)]).T
