"""The motion model: improved frame differencing, and the joint map (equation 5)."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["grey", "joint_map", "local_difference", "moving", "threshold"]

Whole = NDArray[np.int64]
Map = NDArray[np.float64]


def grey(image: NDArray[np.uint8]) -> Whole:
    """Sum of the three channels: a factor cancels in the threshold."""
    return np.asarray(image.sum(axis=2, dtype=np.int64))


def local_difference(
    image: NDArray[np.uint8], previous: NDArray[np.uint8], window: int = 5
) -> Whole:
    """D1: absolute differences of `grey`, summed over a window around each pixel.

    Parameters
    ----------
    image, previous : ndarray of uint8, shape (rows, columns, 3)
        BGR.
    window : int
        Side n of the window, odd [pixels]; what of it lies outside counts for nothing.

    Returns
    -------
    ndarray of int64, shape (rows, columns)
    """
    changed = np.pad(np.abs(grey(image) - grey(previous)), window // 2)
    rows, columns = image.shape[:2]
    across = np.sum([changed[:, left : left + columns] for left in range(window)], axis=0)
    return np.asarray(np.sum([across[top : top + rows] for top in range(window)], axis=0))


def threshold(difference: Whole | Map, factor: float = 2.0) -> float:
    """T = mean + λ · standard deviation, over the whole image."""
    return float(difference.mean() + factor * difference.std())


def moving(difference: Whole | Map, factor: float = 2.0) -> NDArray[np.bool_]:
    """B: where the difference is above its threshold."""
    return np.asarray(difference > threshold(difference, factor))


def joint_map(colour: Map, moving: NDArray[np.bool_], beta: float = 0.8) -> Map:
    """P = (1 - β) I_c + β I_m with I_m = B · I_c (equation 5)."""
    return (1 - beta) * colour + beta * moving * colour
