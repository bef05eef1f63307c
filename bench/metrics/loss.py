"""Definition of a loss: the estimated centre leaves the target and does not return soon."""

import numpy as np
from numpy.typing import NDArray

SUCCESS_OVERLAP = 0.5
"""Minimum overlap of a success."""

LOSS_FRAMES = 10
"""Number of consecutive visible frames with the centre outside the box after which the target
counts as lost.
"""

VISIBLE_FRACTION = 0.3
"""Minimum visible fraction of the target in a frame that can contribute to a loss."""


def first_loss(
    inside: NDArray[np.bool_], evaluated: NDArray[np.bool_], visibility: NDArray[np.float64]
) -> int:
    """Return the frame from which the target is lost; n if it is never lost.

    This is the first of `LOSS_FRAMES` consecutive visible frames in which the estimated centre is
    outside the box. A frame counts as visible if it is evaluated, and if `VISIBLE_FRACTION` of the
    target or an unknown fraction is visible; other frames are skipped. All arguments have shape
    (n,).
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
