"""Ground truth of a run, and the definition of a loss in the metrics preset `native`."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

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
        """Boxes, shape (n, 4); NaN rows if the target is absent or the frame is not annotated."""
        ...

    @property
    def annotated(self) -> NDArray[np.bool_]:
        """Frames with known box or absence, shape (n,), or () if all; others are not used."""
        ...

    @property
    def malformed(self) -> NDArray[np.bool_]:
        """Frames whose box has no size but is no statement of absence, shape (n,), or () if none.

        Their boxes are NaN. They count as absence, except in toolkits that score them.
        """
        ...

    @property
    def regions(self) -> Mapping[str, NDArray[np.float64]]:
        """Boxes of other regions by name, such as `full`, shape (n, 4)."""
        ...

    @property
    def visibility(self) -> NDArray[np.float64]:
        """Visible fraction, shape (n,); NaN if unknown."""
        ...


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
