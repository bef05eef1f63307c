"""Truth of a walking scene: boxes in closed form, the silhouette where it is needed."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.walking.designs import SIZE

__all__ = ["Coverage", "body_boxes", "extents", "full_boxes", "occluded", "visible"]

Array = NDArray[np.float64]

Coverage = tuple[int, int, NDArray[np.uint8]]
"""Left and top [pixels], and how far each pixel is covered, in [0, 255]."""


def body_boxes(x: Array, y: Array, height: Array) -> Array:
    """Shoulders to ankles of standing persons, shape (n, 4), the waist in the middle.

    Parameters
    ----------
    x, y : ndarray of float64, shape (n,)
        Places on the ground below the bodies' axes, in the image [pixels].
    height : ndarray of float64, shape (n,)
        Of the persons in the image [pixels].
    """
    return np.stack([x - 0.12 * height, y - 0.86 * height, 0.24 * height, 0.78 * height], axis=1)


def full_boxes(x: Array, y: Array, height: Array) -> Array:
    """Whole persons in mid-step, head to sole, shape (n, 4); parameters as `body_boxes`."""
    return np.stack([x - 0.18 * height, y - height, 0.36 * height, height], axis=1)


def extents(coverage: Coverage) -> Array:
    """Box around the pixels that are covered at least to one half, shape (4,)."""
    left, top, alpha = coverage
    rows, columns = (np.flatnonzero((alpha >= 128).any(axis=axis)) for axis in (1, 0))
    corner = [left + columns[0], top + rows[0]]
    return np.array([*corner, columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]], np.float64)


def visible(target: Coverage, nearer: Iterable[Coverage]) -> NDArray[np.uint8]:
    """What of the target's coverage is in the picture and behind nothing; its window."""
    left, top, alpha = target
    seen = np.zeros_like(alpha)
    inside = _common((left, top, alpha), (0, 0, np.empty(SIZE[::-1], np.uint8)))
    if inside is not None:
        seen[inside[0]] = alpha[inside[0]]
    for cover in nearer:
        common = _common(target, cover)
        if common is not None:
            seen[common[0]] = occluded(seen[common[0]], cover[2][common[1]])
    return seen


def occluded(alpha: NDArray[np.uint8], cover: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What a cover leaves of a coverage, both in [0, 255]."""
    return ((alpha.astype(np.uint16) * (255 - cover.astype(np.uint16)) + 127) // 255).astype(
        np.uint8
    )


Window = tuple[slice, slice]


def _common(one: Coverage, other: Coverage) -> tuple[Window, Window] | None:
    """Rows and columns that two have in common, in the windows of both."""
    left, top = max(one[0], other[0]), max(one[1], other[1])
    right, bottom = (
        min(corner[side] + corner[2].shape[1 - side] for corner in (one, other)) for side in (0, 1)
    )
    if left >= right or top >= bottom:
        return None
    first, second = (
        (slice(top - item[1], bottom - item[1]), slice(left - item[0], right - item[0]))
        for item in (one, other)
    )
    return first, second
