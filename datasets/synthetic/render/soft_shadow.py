"""The soft shadow that a thing throws on what is far behind it."""

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["light_left"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

COARSE = 4
"""Pixels a sample of a shadow, in either direction."""


def light_left(coverage: Floats, shift: Array, softness: float, darkness: float) -> Floats:
    """Light that is left behind something.

    Parameters
    ----------
    coverage : ndarray of float32, shape (height, width)
        What the thing covers of each pixel, in [0, 1]; sides are multiples of `COARSE`.
    shift : ndarray of float64, shape (2,)
        From the thing to its shadow [pixels].
    softness : float
        Standard deviation of the shadow's blur [pixels].
    darkness : float
        Part of the light that is missing in its middle, in [0, 1].

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        In [0, 1].
    """
    size = coverage.shape[1], coverage.shape[0]
    coarse = size[0] // COARSE, size[1] // COARSE
    small = cv2.resize(coverage, coarse, interpolation=cv2.INTER_AREA)
    matrix = np.column_stack([np.eye(2), shift / COARSE])
    moved = np.asarray(cv2.warpAffine(small, matrix, coarse))
    left = 1 - np.float32(darkness) * cv2.GaussianBlur(moved, (0, 0), softness / COARSE)
    return np.asarray(cv2.resize(cv2.merge([left] * 3), size, interpolation=cv2.INTER_LINEAR))
