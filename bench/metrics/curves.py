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
    values: NDArray[np.float64],
    thresholds: NDArray[np.float64],
    limits: NDArray[np.float64] | None = None,
    *,
    above: bool = False,
) -> NDArray[np.float64]:
    """Return the curve of the share of values up to, or above, each threshold.

    `limits`: compared with the values instead of the thresholds. Returns points (threshold, share),
    shape (thresholds, 2). NaN is no hit. Shares of no values are NaN.
    """
    ordered = np.sort(values)  # NaN last
    hits = ordered.searchsorted(thresholds if limits is None else limits, "right")
    if above:
        hits = ordered.searchsorted(np.nan) - hits
    return np.array([thresholds, hits / (len(values) or np.nan)]).T


def normalised_error(
    truth: NDArray[np.float64], estimate: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of centres in widths and heights of the truth, row by row, shape (n,).

    Both have shape (n, 4). No number at most a threshold where the truth is absent or has no size,
    or the estimate is not finite.
    """
    return _distance(truth, estimate, truth[:, 2:])


def plain_error(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of centres in pixels, of boxes without size, too; as `normalised_error`."""
    return _distance(truth, estimate, np.ones((len(truth), 2)))


def _distance(
    truth: NDArray[np.float64], estimate: NDArray[np.float64], unit: NDArray[np.float64]
) -> NDArray[np.float64]:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # boxes of 1e308, too
        difference = estimate[:, :2] + estimate[:, 2:] / 2 - (truth[:, :2] + truth[:, 2:] / 2)
        return np.asarray(np.sqrt(((difference / unit) ** 2).sum(axis=1)))
