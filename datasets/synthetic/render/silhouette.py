"""Silhouettes: where they lie, and what of them is seen."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.pinhole import SIZE

__all__ = ["Coverage", "extents", "visible"]

Array = NDArray[np.float64]

Coverage = tuple[int, int, NDArray[np.uint8]]
"""Left and top [pixels], and how far each pixel is covered, in [0, 255]."""


def extents(coverage: Coverage) -> Array:
    """Box around the pixels that are covered at least to one half, shape (4,)."""
    left, top, alpha = coverage
    rows, columns = (np.flatnonzero((alpha >= 128).any(axis=axis)) for axis in (1, 0))
    corner = [left + columns[0], top + rows[0]]
    return np.array([*corner, columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]], np.float64)


def visible(target: Coverage, nearer: Iterable[Coverage]) -> Coverage:
    """What of the target is in the picture and behind nothing; its window is in the picture."""
    left, top, alpha = target
    height, width = alpha.shape
    x, y = max(left, 0), max(top, 0)
    right, bottom = max(min(left + width, SIZE[0]), x), max(min(top + height, SIZE[1]), y)
    seen = alpha[y - top : bottom - top, x - left : right - left].copy()
    for cover in nearer:
        common = _common((x, y, seen), cover)
        if common is not None:
            seen[common[0]] = _occluded(seen[common[0]], cover[2][common[1]])
    return x, y, seen


def _occluded(alpha: NDArray[np.uint8], cover: NDArray[np.uint8]) -> NDArray[np.uint8]:
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
