"""What happened in a run: errors over stretches of frames, tolerance, losses, how weights fared.

Frames are counted from 1, as the paper counts them. The tolerance is half the mean side of the
sequence's boxes.
"""

from collections.abc import Mapping
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error
from bench.metrics.native import Truth

__all__ = [
    "CUP",
    "CURVE",
    "HAND",
    "SHOWN",
    "STRETCHES",
    "TABLE_TENNIS",
    "course_of",
    "errors_of",
    "tolerance_of",
]

TABLE_TENNIS, HAND, CUP = (f"wang2010/{name}" for name in ("table-tennis", "hand", "cup"))

STRETCHES = {
    TABLE_TENNIS: ((1, 11), (12, 16), (1, 16), (1, 22), (1, 50)),
    HAND: ((1, 48), (49, 100)),
    CUP: ((1, 35), (36, 80)),
}
"""First and last frames between which errors are averaged."""

SHOWN = {TABLE_TENNIS: (10, 11, 12, 16), HAND: (10, 38, 49, 58, 100), CUP: (18, 36, 44, 51, 80)}
"""The frames of Fig. 3, 5 and 6, and the last one of the hand and the cup."""

CURVE = (11, 12, 13, 14, 16, 20, 22, 30, 40, 50)
"""Frames at which the error of Fig. 4 is told in figures."""

SUCCESS, LAST = 0.9, 10
"""A run succeeds that is within the tolerance in this share of frames, and in all of the last."""

CENTRED = 48
"""Index of the frame in which the hand is centred on the face, frame 49."""

LOST, SETTLED = 5, 5
"""Frames in a row beyond the tolerance that make a loss, and within it that make a return."""

DETAILS = ("effective_sample_size", "weight_ratio", "spread", "modes", "iterations")

Errors = NDArray[np.float64]


def tolerance_of(truth: Truth) -> float:
    """Half the mean side of the boxes, in pixels."""
    return float(np.nanmean(truth.boxes[:, 2:]) / 2)


def errors_of(run: Run, truth: Truth) -> Errors:
    """Centre error by frame, shape (n,), in pixels; NaN where the target is absent."""
    return centre_error(truth.boxes, run.boxes)


def course_of(run: Run, truth: Truth, sequence: str) -> dict[str, float]:
    """What is known of a finished run.

    Parameters
    ----------
    run : Run
        With boxes in every frame.
    truth : Truth
        Of its sequence.
    sequence : str
        The sequence's name without variant, which says what frames are asked for.

    Returns
    -------
    dict of str to float
        A yes or no is 1 or 0, NaN where what is asked did not arise. `tolerance` [pixels];
        `tolerated` (share of frames within it), `success`, `stayed_lost` (of those lost with time
        enough to return). By sequence, `a` and `b` being frames: `centre_error_a_to_b` (mean),
        `error_at_a` [pixels], `tolerated_at_a`, `on_the_face_at_58` (of the hand: it is within
        the tolerance of the face's middle), and what `_events` gives. Means over frames of
        the tracker's details `DETAILS`; `least_sample_size`, the least of the first of these.
    """
    errors, tolerance = errors_of(run, truth), tolerance_of(truth)
    within = errors[np.isfinite(truth.boxes).all(axis=1)] <= tolerance
    known = {
        "tolerance": tolerance,
        "tolerated": float(within.mean()),
        "success": float(within.mean() >= SUCCESS and within[-LAST:].all()),
        "stayed_lost": _stayed_lost(within),
    }
    for first, last in STRETCHES.get(sequence, ()):
        known[f"centre_error_{first}_to_{last}"] = _mean(errors[first - 1 : last])
    for frame in SHOWN.get(sequence, ()):
        known[f"tolerated_at_{frame}"] = float(errors[frame - 1] <= tolerance)
    curve = CURVE if sequence == TABLE_TENNIS else ()
    for frame in sorted({*SHOWN.get(sequence, ()), *curve}):
        known[f"error_at_{frame}"] = float(errors[frame - 1])
    if sequence == HAND:
        known["on_the_face_at_58"] = float(_to_the_face(run, truth) <= tolerance)
    return known | _events(sequence, errors <= tolerance) | _details(run.details)


def _to_the_face(run: Run, truth: Truth) -> float:
    """Distance at frame 58 to where the hand is centred on the face, in frame 49 [pixels]."""
    return float(centre_error(truth.boxes[[CENTRED]], run.boxes[[57]])[0])


def _events(sequence: str, within: NDArray[np.bool_]) -> dict[str, float]:
    """What claims ask of single frames of a sequence."""

    def at(*frames: int) -> NDArray[np.bool_]:
        return np.asarray(within[np.array(frames) - 1])

    if sequence == TABLE_TENNIS:
        deviates = not within[11:15].all()
        return {
            "tolerated_12_to_16": float(within[11:16].all()),
            "deviates_12_to_15": float(deviates),
            "back_at_16": float(within[15]) if deviates else nan,
            "still_wrong_at_16": float(deviates and not within[15]),
        }
    if sequence == HAND:
        return {
            "tolerated_at_10_and_38": float(at(10, 38).all()),
            "lost_at_58_and_100": float(not at(58, 100).any()),
        }
    if sequence == CUP:
        return {
            "tolerated_1_to_17": float(within[:17].all()),
            "lost_at_36_and_44_and_51": float(not at(36, 44, 51).any()),
        }
    return {}


def _stayed_lost(within: NDArray[np.bool_]) -> float:
    """Whether a target once lost is never back; NaN where it is not lost, or too late to tell."""
    losses = _starts(~within, LOST)
    if not len(losses) or losses[0] + LOST + SETTLED > len(within):
        return nan
    return float(not len(_starts(within[losses[0] :], SETTLED)))


def _starts(flags: NDArray[np.bool_], length: int) -> NDArray[np.intp]:
    """Where so many flags in a row begin."""
    if len(flags) < length:
        return np.empty(0, np.intp)
    rows = np.lib.stride_tricks.sliding_window_view(flags, length)
    return np.flatnonzero(rows.all(axis=1))


def _details(details: Mapping[str, NDArray[np.float64]]) -> dict[str, float]:
    known = {name: _mean(details[name]) if name in details else nan for name in DETAILS}
    sizes = details.get("effective_sample_size", np.empty(0))
    sizes = sizes[np.isfinite(sizes)]
    return known | {"least_sample_size": float(sizes.min()) if len(sizes) else nan}


def _mean(values: NDArray[np.float64]) -> float:
    """Mean of what is known; NaN for nothing."""
    values = values[~np.isnan(values)]
    return float(values.mean()) if len(values) else nan
