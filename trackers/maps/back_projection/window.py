"""The size of CamShift's window."""

from math import floor, sqrt

__all__ = ["SMALLEST_WINDOW", "adapted_window"]

SMALLEST_WINDOW = 3
"""Pixels a side that Bradski's rule never goes below."""


def adapted_window(weight: float, ratio: float, image_shape: tuple[int, ...]) -> tuple[int, int]:
    """Size of the next frame's window by Bradski's rule (Intel Technology Journal Q2, 1998).

    Its sides are 2 √(M₀₀ · ratio) and 2 √(M₀₀ / ratio), at least 3 pixels and at most the image's.

    Parameters
    ----------
    weight : float
        M₀₀, the sum of the back-projection, in [0, 1] a pixel, over the window [pixels].
    ratio : float
        Width of the target over its height.
    image_shape : tuple of int
        Rows and columns of the image.

    Returns
    -------
    width, height : int
        In pixels.
    """
    width = floor(2 * sqrt(weight * ratio) + 0.5)
    height = floor(2 * sqrt(weight / ratio) + 0.5)
    return (
        min(max(width, SMALLEST_WINDOW), image_shape[1]),
        min(max(height, SMALLEST_WINDOW), image_shape[0]),
    )
