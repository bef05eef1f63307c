"""Shares of frames by threshold: success by overlap, precision by distance."""

import numpy as np
from numpy.typing import NDArray

OVERLAPS = np.linspace(0, 1, 21)
"""Thresholds of overlap of the OTB family."""

DISTANCES = np.arange(51.0)
"""Thresholds of the centre's distance of the OTB family, in pixels."""

NORMALISED_DISTANCES = np.arange(51) / 100
"""Thresholds of the centre's distance in widths and heights of the truth."""


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


def centre_distance(
    truth: NDArray[np.float64],
    estimate: NDArray[np.float64],
    unit: NDArray[np.float64] | float = 1.0,
) -> NDArray[np.float64]:
    """Return the distance of centres in units of width and height, row by row, shape (n,).

    Boxes have shape (n, 4), units (n, 2). The distance is no number at most a threshold if the
    target is absent, the unit is 0 or the estimate is not finite. Boxes need no size.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # boxes of 1e308, too
        difference = estimate[:, :2] + estimate[:, 2:] / 2 - (truth[:, :2] + truth[:, 2:] / 2)
        return np.asarray(np.sqrt(((difference / unit) ** 2).sum(axis=1)))
