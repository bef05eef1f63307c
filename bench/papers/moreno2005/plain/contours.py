"""Contours: of a mask, what is inside of them, and x₃ (section 4.3)."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

__all__ = ["area", "crosses_itself", "inside", "outline", "propagated"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outline(mask: Mask, points: int) -> Array:
    """Outer boundary of a mask's largest part, at equal distances, clockwise from its top."""
    parts, number = label(mask, np.ones((3, 3)))
    boundaries = [_boundary(parts == part) for part in range(1, number + 1)]
    boundary = max(boundaries, key=area)
    closed = np.vstack([boundary, boundary[:1]])
    passed = np.append(0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    wanted = passed[-1] * np.arange(points) / points
    return np.stack([np.interp(wanted, passed, x) for x in closed.T], axis=1)


def _boundary(part: Mask) -> Array:
    """Middles of the sides of pixels between a part and what is outside, in their order."""
    padded = np.pad(part, 1)
    row, column = np.argwhere(part)[0]
    corner, direction = np.array([column, row]), np.array([1, 0])  # along its upper side
    start = tuple(corner)
    middles: list[Array] = []
    while not middles or tuple(corner) != start or tuple(direction) != (1, 0):
        middles.append(corner + direction / 2)
        corner = corner + direction
        right = np.array([-direction[1], direction[0]])
        # Pixels ahead, on the outer and on the inner side; they may touch by corners.
        ahead = [corner + (direction + side * right - 1) // 2 + 1 for side in (-1, 1)]
        outer, inner = (padded[y, x] for x, y in ahead)
        if outer:
            direction = -right
        elif not inner:
            direction = right
    return np.array(middles)


def inside(contour: Array, height: int, width: int) -> Mask:
    """Pixels whose centres are inside: to their right, the contour passes an odd number of times.

    With `<=` on one side and `<` on the other, contours that share a side share no pixel.
    """
    found = np.zeros((height, width), bool)
    left, top = np.clip(np.floor(contour.min(axis=0)).astype(int), 0, [width, height])
    right, bottom = np.clip(np.ceil(contour.max(axis=0)).astype(int), 0, [width, height])
    x, y = np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5
    for (x0, y0), (x1, y1) in zip(contour, np.roll(contour, -1, axis=0), strict=True):
        passed = (min(y0, y1) <= y) & (y < max(y0, y1))
        crossings = x0 + (y[passed] - y0) * (x1 - x0) / (y1 - y0)
        found[top:bottom, left:right][passed] ^= x < crossings[:, np.newaxis]
    return found


def area(contour: Array) -> float:
    """By the shoelace formula."""
    (x0, y0), (x1, y1) = contour.T, np.roll(contour, -1, axis=0).T
    return float(abs((x0 * y1 - x1 * y0).sum()) / 2)


def crosses_itself(contour: Array) -> bool:
    """Whether two sides that aren't neighbours cross."""
    n = len(contour)
    sides = [(contour[i], contour[(i + 1) % n]) for i in range(n)]

    def apart(a: Array, b: Array, c: Array, d: Array) -> bool:
        """Whether c and d are on different sides of the line through a and b."""
        (x, y), (xc, yc), (xd, yd) = b - a, c - a, d - a
        return bool((x * yc - y * xc) * (x * yd - y * xd) <= 0)

    return any(
        apart(*sides[i], *sides[j]) and apart(*sides[j], *sides[i])
        for i in range(n)
        for j in range(i + 2, n - (i == 0))
    )


def propagated(contours: Array, affine: Array, shift: Array, random: np.random.Generator) -> Array:
    """Equation 5 of contours: s = m + H (s' - m) + p, with m the mean of the points of s'."""
    h = np.eye(2) + random.normal(size=(len(contours), 2, 2)) * affine
    p = random.normal(size=(len(contours), 2)) * shift
    moved = []
    for j, contour in enumerate(contours):
        m = contour.mean(axis=0)
        moved.append(m + (contour - m) @ h[j].T + p[j])
    return np.array(moved)
