"""Definitions of the metrics preset `native`, in which a perfect tracker scores 1.

The frames with a target after the initialisation are evaluated. Overlaps refer to `boxes`.
`frames_inside` and `first_loss` refer to the region `full`, the whole object, if there is one.
Unknown visibility counts as visible. A malformed estimate is a miss: overlap 0, centre error
infinite.
"""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.centre_error import centre_error, centre_inside
from trackmark.bench.metrics.overlap import is_well_formed, overlap

SUCCESS_OVERLAP = 0.5
"""Minimum overlap of a success."""

LOSS_FRAMES = 10
"""Number of consecutive visible frames with the centre outside the box that make a failure."""

VISIBLE_FRACTION = 0.3
"""Minimum visible fraction of a frame that can contribute to a failure."""


class GroundTruthLike(Protocol):
    """Ground truth of n frames, for example a `datasets.Sequence`."""

    @property
    def boxes(self) -> NDArray[np.float64]:
        """Boxes, shape (n, 4); NaN rows if the target is absent."""
        ...

    @property
    def regions(self) -> Mapping[str, NDArray[np.float64]]:
        """Boxes of other regions by name, such as `full`, shape (n, 4)."""
        ...

    @property
    def visibility(self) -> NDArray[np.float64]:
        """Visible fraction, shape (n,); NaN if unknown."""
        ...


def native(
    truth: GroundTruthLike, estimate: NDArray[np.float64], visible: NDArray[np.bool_] | None = None
) -> dict[str, float]:
    """Compute the scores of the preset `native`; the columns of the preset describe them.

    `estimate`: boxes in pixels, shape (n, 4); rows up to the initialisation are ignored.
    `visible`: shape (n,), True if the tracker reported the target; without it `absence_reported` is
    NaN. Raises `ValueError` if there is no ground truth or the numbers of rows differ.
    """
    n = len(truth.boxes)
    if estimate.shape != (n, 4):
        raise ValueError(
            f"Estimated boxes have shape {estimate.shape}. Expected: ({n}, 4), as the ground truth."
        )
    present = np.isfinite(truth.boxes).all(axis=1)
    if not present.any():
        raise ValueError("The ground truth has no frame with a target. Expected: at least one.")
    after = np.arange(n) > np.flatnonzero(present)[0]
    evaluated, absent = present & after, ~present & after
    t, e = truth.boxes[evaluated], estimate[evaluated]
    overlaps, errors = overlap(t, e), centre_error(t, e)
    inside = centre_inside(truth.regions.get("full", truth.boxes), estimate)
    return {
        "evaluated_frames": float(evaluated.sum()),
        "mean_overlap": _mean(overlaps),
        "success_frames": float((overlaps >= SUCCESS_OVERLAP).sum()),
        "success_share": _mean(overlaps >= SUCCESS_OVERLAP),
        "frames_inside": float((inside & evaluated).sum()),
        "inside_share": _mean(inside[evaluated]),
        "first_loss": float(first_loss(inside, evaluated, truth.visibility)),
        "centre_error": _mean(errors),
        "centre_error_median": _quantile(errors, 0.5),
        "centre_error_p90": _quantile(errors, 0.9),
        "normalised_centre_error": _mean(errors / np.hypot(t[:, 2], t[:, 3])),
        "malformed": float((~is_well_formed(e)).sum()),
        "absent_frames": float(absent.sum()),
        "absence_reported": _mean(~visible[absent]) if visible is not None else np.nan,
    }


def first_loss(
    inside: NDArray[np.bool_], evaluated: NDArray[np.bool_], visibility: NDArray[np.float64]
) -> int:
    """Return the first frame of a loss, `LOSS_FRAMES` frames with the centre outside; n if none.

    The frames of a loss are consecutive evaluated frames in which `VISIBLE_FRACTION` of the target
    or an unknown fraction is visible. Other frames are skipped. All arguments have shape (n,).
    """
    counted = np.flatnonzero(evaluated & ~(visibility < VISIBLE_FRACTION))
    start = first_streak(~inside[counted], LOSS_FRAMES)
    return int(counted[start]) if start < len(counted) else len(inside)


def first_streak(flags: NDArray[np.bool_], length: int) -> int:
    """Return the index of the first `length` consecutive true flags; `len(flags)` if none."""
    if len(flags) < length:
        return len(flags)
    streaks = np.lib.stride_tricks.sliding_window_view(flags, length).all(axis=1)
    return int(streaks.argmax()) if streaks.any() else len(flags)


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _quantile(values: NDArray[np.float64], q: float) -> float:
    """Return a quantile by linear interpolation; infinite if an interpolated value is infinite."""
    if not len(values):
        return np.nan
    ordered = np.sort(values)
    position = q * (len(values) - 1)
    below = int(position)
    weight = position - below
    if weight == 0.0:
        return float(ordered[below])
    upper = ordered[below + 1]
    return float((1 - weight) * ordered[below] + weight * upper) if np.isfinite(upper) else np.inf
