"""The metrics preset `native`: the clean definitions, by which a perfect tracker scores 1.

Frames after that of initialisation in which the target is present are evaluated. The overlap is
that with `boxes`; `frames_inside` and `first_loss` use the region `full` if the sequence has one.
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
"""Overlap from which a frame is a success."""

LOSS_FRAMES = 10
"""Consecutive visible frames with the centre outside after which the target is lost."""

VISIBLE_FRACTION = 0.3
"""Visible fraction from which a frame counts for the loss."""


class Truth(Protocol):
    """Ground truth of n frames, by which scores are computed; a `datasets.Sequence` is one."""

    @property
    def boxes(self) -> NDArray[np.float64]:
        """Boxes, shape (n, 4); NaN rows if the target is absent."""
        ...

    @property
    def regions(self) -> Mapping[str, NDArray[np.float64]]:
        """Further ground truths by name, shape (n, 4) each."""
        ...

    @property
    def visibility(self) -> NDArray[np.float64]:
        """Visible fraction, shape (n,); NaN if unknown."""
        ...


def native(
    truth: Truth, estimate: NDArray[np.float64], visible: NDArray[np.bool_] | None = None
) -> dict[str, float]:
    """Score boxes by the preset `native`, whose columns state the scores.

    `estimate`: boxes in pixels, shape (n, 4); rows up to the frame of initialisation do not matter.
    `visible`: shape (n,), whether the tracker reported the target; `absence_reported` is NaN
    without it. Raises `ValueError` if there is no ground truth or the numbers of rows differ.
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
    inside: NDArray[np.bool_], evaluated: NDArray[np.bool_], visibility: NDArray[np.float64]
) -> int:
    """Return the first of `LOSS_FRAMES` consecutive frames with the centre outside; n if none.

    Only evaluated frames count in which at least `VISIBLE_FRACTION` of the target, or an unknown
    fraction, is visible. All arguments have shape (n,).
    """
    counted = np.flatnonzero(evaluated & ~(visibility < VISIBLE_FRACTION))
    start = first_streak(~inside[counted], LOSS_FRAMES)
    return int(counted[start]) if start < len(counted) else len(inside)


def first_streak(flags: NDArray[np.bool_], length: int) -> int:
    """Return where the first `length` consecutive true flags begin; their number if nowhere."""
    if len(flags) < length:
        return len(flags)
    streaks = np.lib.stride_tricks.sliding_window_view(flags, length).all(axis=1)
    return int(streaks.argmax()) if streaks.any() else len(flags)


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _quantile(values: NDArray[np.float64], q: float) -> float:
    """Quantile by linear interpolation; infinite as soon as an infinite value has a share."""
    if not len(values):
        return np.nan
    ordered = np.sort(values)
    position = q * (len(values) - 1)
    below = int(position)
    part = position - below
    if part == 0.0:
        return float(ordered[below])
    upper = ordered[below + 1]
    return float((1 - part) * ordered[below] + part * upper) if np.isfinite(upper) else np.inf
