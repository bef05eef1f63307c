"""Light and shade on heights."""

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["lit", "shade"]

Floats = NDArray[np.float32]

SUN = np.array([-0.42, -0.5, 0.757], np.float32)
"""Where the light comes from: to the right, down, towards the camera."""

AMBIENT = 0.55
"""Light from all around, of what falls on level ground."""


def lit(height: Floats, soft: float) -> Floats:
    """Light on a surface, 1 on level ground, shape (rows, columns).

    Parameters
    ----------
    height : ndarray of float32, shape (rows, columns)
        In samples.
    soft : float
        Standard deviation of the blur that rounds edges [samples].
    """
    smooth = cv2.GaussianBlur(height, (0, 0), soft)
    right = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    straight = (SUN[2] - SUN[0] * right - SUN[1] * down) / np.sqrt(1 + right * right + down * down)
    return np.asarray(AMBIENT + (1 - AMBIENT) / SUN[2] * np.maximum(straight, 0), np.float32)


def shade(
    canvas: Floats, cover: Floats, shift: tuple[int, int], soft: float, darkness: float
) -> None:
    """Darken a canvas where something takes the light.

    Parameters
    ----------
    canvas : ndarray of float32, shape (rows, columns, 3)
        Changed in place.
    cover : ndarray of float32, shape (rows, columns)
        In [0, 1].
    shift : tuple of int
        From what takes the light to its shadow, to the right and down, not 0 [samples].
    soft : float
        Standard deviation of the shadow's edge [samples].
    darkness : float
        What is taken in full shade.
    """
    right, down = shift
    thrown = np.zeros_like(cover)
    thrown[down:, right:] = cover[:-down, :-right]
    kept = 1 - np.float32(darkness) * np.asarray(cv2.GaussianBlur(thrown, (0, 0), soft), np.float32)
    canvas *= kept[..., None]
