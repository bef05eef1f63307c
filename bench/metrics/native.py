"""The metrics preset `native`: the clean definitions, which a perfect tracker scores 1 by.

Conventions
-----------
Evaluated are the frames after the one of initialisation in which the target is present.
Overlap's reference is `boxes`; `frames_inside` and `first_loss` use the region `full`
where the sequence has one. Unknown visibility counts as visible. A malformed estimate is
a miss: overlap 0, centre error infinite.
"""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.centre_error import centre_error, centre_inside
from trackmark.bench.metrics.overlap import is_well_formed, overlap

SUCCESS_OVERLAP = 0.5
"""Overlap from which a frame is a success."""

LOSS_FRAMES = 10
"""Consecutive visible frames with the centre outside after which the target is lost."""

VISIBLE_FRACTION = 0.3
"""Visible fraction from which a frame counts for the loss."""


class Truth(Protocol):
    """What scores are computed against; a `datasets.Sequence` is one."""

    @property
    def boxes(self) -> NDArray[np.float64]:
        """Boxes, shape (n, 4); NaN rows where the target is absent."""
        ...

    @property
    def regions(self) -> Mapping[str, NDArray[np.float64]]:
        """Further truths by name, shape (n, 4) each."""
        ...

    @property
    def visibility(self) -> NDArray[np.float64]:
        """Visible fraction, shape (n,); NaN where unknown."""
        ...


def native(
    truth: Truth,
    estimate: NDArray[np.float64],
    visible: NDArray[np.bool_] | None = None,
) -> dict[str, float]:
    """Score boxes by the preset `native`.

    Parameters
    ----------
    truth : Truth
        The sequence's truth, n frames.
    estimate : ndarray of float64, shape (n, 4)
        Boxes in pixels; rows up to the frame of initialisation are not looked at.
    visible : ndarray of bool, shape (n,), optional
        Whether the tracker said that it sees the target.

    Returns
    -------
    dict of str to float
        `evaluated_frames`, `mean_overlap`, `success_frames`, `success_share`,
        `frames_inside`, `inside_share`, `first_loss`, `centre_error` (mean), `centre_error_median`,
        `centre_error_p90`, `normalised_centre_error` (mean of the error divided by the
        truth's diagonal), `malformed`, `absent_frames`, and `absence_reported`: the share
        of absent frames reported as not visible (NaN where nothing is known).

    Raises
    ------
    ValueError
        Where there is no truth or the numbers of rows differ.
    """
    n = len(truth.boxes)
    if estimate.shape != (n, 4):
        raise ValueError(f"the boxes have shape {estimate.shape}, the truth ({n}, 4).")
    present = np.isfinite(truth.boxes).all(axis=1)
    if not present.any():
        raise ValueError("there is no truth to score against.")
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
    inside: NDArray[np.bool_],
    evaluated: NDArray[np.bool_],
    visibility: NDArray[np.float64],
) -> int:
    """First of `LOSS_FRAMES` consecutive frames with the centre outside; n if there is none.

    Consecutive among the evaluated frames in which at least `VISIBLE_FRACTION` of the
    target, or an unknown fraction, is visible. All arguments have shape (n,).
    """
    counted = np.flatnonzero(evaluated & ~(visibility < VISIBLE_FRACTION))
    outside = ~inside[counted]
    if len(outside) < LOSS_FRAMES:
        return len(inside)
    windows = np.lib.stride_tricks.sliding_window_view(outside, LOSS_FRAMES).all(axis=1)
    starts = np.flatnonzero(windows)
    return int(counted[starts[0]]) if len(starts) else len(inside)


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _quantile(values: NDArray[np.float64], q: float) -> float:
    """Quantile by linear interpolation; infinite as soon as an infinite value has a share."""
    if not len(values):
        return float("nan")
    ordered = np.sort(values)
    position = q * (len(values) - 1)
    below = int(position)
    part = position - below
    if part == 0.0:
        return float(ordered[below])
    upper = ordered[below + 1]
    return float((1 - part) * ordered[below] + part * upper) if np.isfinite(upper) else np.inf
