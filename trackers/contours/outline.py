"""Contours and masks: one from the other, and what a contour encloses."""

import cv2
import numpy as np
from numpy.typing import NDArray

from trackers.base.interface import Box, Mask
from trackers.contours.sums import windings

__all__ = [
    "bounding_box",
    "crosses_itself",
    "enclosed_area",
    "equally_spaced",
    "filled",
    "inscribed_ellipse",
    "outline",
]

Contour = NDArray[np.float64]


def outline(mask: Mask, points: int = 32) -> Contour:
    """The outer boundary of a mask's largest part.

    It passes half-way between the centres of neighbours of which one is inside: filled, it would
    be the part (without holes) again, if it weren't for the chords between its points.

    Parameters
    ----------
    mask : ndarray of bool, shape (height, width)
        Pixels that touch at a corner are connected; raises ValueError where there are none.
    points : int
        How many the contour has.

    Returns
    -------
    ndarray of float64, shape (points, 2)
        Equally spaced in arc length, clockwise on the screen, from the topmost point (the leftmost
        of several) on.
    """
    if not mask.any():
        raise ValueError("the mask has no pixels, so it has no outline; give one with some.")
    # Interpolated on a grid twice as fine, which has the points half-way between two centres.
    height, width = mask.shape
    fine = np.zeros((2 * height + 1, 2 * width + 1), np.uint8)
    fine[1::2, 1::2] = mask
    interpolation = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]], np.float32)
    fine = cv2.filter2D(fine, -1, interpolation, borderType=cv2.BORDER_CONSTANT) >= 2
    chains, _ = cv2.findContours(fine.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    chain = max(chains, key=cv2.contourArea)[::-1, 0]
    first = np.lexsort(chain.T)[0]
    return equally_spaced(np.roll(chain, -first, axis=0) / 2, points)


def filled(contour: Contour, height: int, width: int) -> Mask:
    """Pixels of an image whose centres are inside a contour (points, 2), by the rule of `sums`."""
    inside: Mask = windings(contour, height, width) != 0
    return inside


def bounding_box(contour: Contour) -> Box:
    """The least box around a contour."""
    least = contour.min(axis=0)
    return np.concatenate([least, contour.max(axis=0) - least])


def inscribed_ellipse(box: Box, height: int, width: int) -> Mask:
    """Pixels of an image whose centres are inside the ellipse that touches a box's four sides."""
    half = box[2:] / 2
    centre = box[:2] + half
    x = (np.arange(width) + 0.5 - centre[0]) / half[0]
    y = (np.arange(height) + 0.5 - centre[1]) / half[1]
    inside: Mask = x**2 + y[:, None] ** 2 <= 1
    return inside


def enclosed_area(contour: Contour) -> float:
    """Area of what a contour encloses, in square pixels.

    Examples
    --------
    >>> enclosed_area(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]))
    6.0
    """
    x, y = (contour - contour[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def crosses_itself(contour: Contour) -> bool:
    """Whether two sides of a contour that aren't neighbours have a point in common."""
    n = len(contour)
    a, b = np.triu_indices(n, 2)
    apart = (a > 0) | (b < n - 1)  # the last side is the first one's neighbour
    a, b = a[apart], b[apart]
    ends = np.roll(contour, -1, axis=0)
    least, most = np.minimum(contour, ends), np.maximum(contour, ends)
    near = ((least[a] <= most[b]) & (least[b] <= most[a])).all(axis=1)
    a, b = a[near], b[near]
    return bool((_parted(contour, ends, a, b) & _parted(contour, ends, b, a)).any())


def _parted(starts: Contour, ends: Contour, a: NDArray[np.intp], b: NDArray[np.intp]) -> Mask:
    """Whether the line through each side a has the two ends of side b not on one side of it."""
    x, y = (ends[a] - starts[a]).T
    start, end = starts[b] - starts[a], ends[b] - starts[a]
    parted: Mask = (x * start[:, 1] - y * start[:, 0]) * (x * end[:, 1] - y * end[:, 0]) <= 0
    return parted


def equally_spaced(contour: Contour, points: int) -> Contour:
    """So many points at equal distances along a closed contour (n, 2), the first its own first."""
    closed = np.concatenate([contour, contour[:1]])
    lengths = np.hypot(*np.diff(closed, axis=0).T)
    passed = np.concatenate([[0.0], lengths.cumsum()])
    places = np.arange(points) / points * passed[-1]
    return np.stack([np.interp(places, passed, closed[:, k]) for k in (0, 1)], axis=1)
