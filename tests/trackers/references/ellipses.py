"""Kernel-weighted colour histograms of ellipses over whole images in NumPy.

See Nummiaro et al. 2003, equations 2 to 4, and Comaniciu, Ramesh & Meer 2003. `whole` weights are
integers in units of 1/65536; as in the trackers, the decrease along each axis is rounded down.
"""

import cv2
import numpy as np


def codes_of(image, colour="rgb", bins=8):
    """Return the joint bin of every pixel of a BGR image."""
    if colour == "rgb":
        blue, green, red = np.moveaxis(image.astype(int) * bins // 256, 2, 0)
        return (red * bins + green) * bins + blue
    hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    half = bins // 2
    return (hue * bins // 180 * bins + saturation * bins // 256) * half + value * half // 256


def pixels_of(codes, ellipse, kernel="epanechnikov", *, whole=True):
    """Return codes, columns, rows and weights of the pixels with centres in an ellipse."""
    x, y, half_x, half_y = ellipse
    full = 65536 if whole else 1.0
    falls = {
        "isotropic": (full / (half_x * half_x + half_y * half_y),) * 2,
        "epanechnikov": (full / (half_x * half_x), full / (half_y * half_y)),
        "uniform": (0.0, 0.0),
    }[kernel]
    rows, columns = np.indices(codes.shape) + 0.5
    across, down = columns - x, rows - y
    inside = (across / half_x) ** 2 + (down / half_y) ** 2 <= 1
    falloff = falls[0] * across * across, falls[1] * down * down
    if whole:
        falloff = np.floor(falloff[0]), np.floor(falloff[1])
    weights = full - falloff[0] - falloff[1]
    return codes[inside], columns[inside], rows[inside], weights[inside]


def histogram_of(codes, n_bins, ellipse, kernel="epanechnikov", *, whole=True):
    """Return the normalised histogram, or zeros if no pixel is inside."""
    actual, _, _, weights = pixels_of(codes, ellipse, kernel, whole=whole)
    histogram = np.bincount(actual, weights, n_bins)
    return histogram / histogram.sum() if len(actual) else histogram
