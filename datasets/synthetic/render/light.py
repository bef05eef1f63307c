"""Light over picture and time, as gains of columns and rows."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["GAIN_STEPS", "fixed_point", "passing_cloud", "smooth_step", "vignette"]

GAIN_STEPS = 1024
"""Steps in a gain of 1."""


def fixed_point(gains: NDArray[np.float64]) -> NDArray[np.int32]:
    """Gains in 1 / `GAIN_STEPS`, rounded."""
    return np.round(gains * GAIN_STEPS).astype(np.int32)


def smooth_step(values: NDArray[np.float64], start: float, end: float) -> NDArray[np.float64]:
    """Cubic transition from 0 (at `start` and before) to 1 (at `end` and after)."""
    u = np.clip((values - start) / (end - start), 0.0, 1.0)
    return u * u * (3 - 2 * u)


def vignette(size: int, fall: float) -> NDArray[np.float64]:
    """Gain of each row or column: 1 in the middle, 1 - `fall` at both ends; shape (size,)."""
    u = (np.arange(size) + 0.5) / size * 2 - 1
    return 1 - fall * u * u


def passing_cloud(
    progress: NDArray[np.float64], across: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How far a cloud takes the sun, in [0, 1].

    The shade crosses the picture from one side: none at the start, everywhere in the
    middle, none at the end.

    Parameters
    ----------
    progress : ndarray
        Elapsed fraction of the sequence, in [0, 1].
    across : ndarray, broadcastable with `progress`
        Place in the picture along the cloud's way, in [-1, 1].
    """
    phase = progress - 0.08 * across
    return smooth_step(phase, 0.15, 0.4) - smooth_step(phase, 0.6, 0.85)
