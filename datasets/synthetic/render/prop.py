"""Static objects in a street, which are painted once, and visible parts of silhouettes."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.sprite import Sprite, instants
from trackmark.datasets.synthetic.render.views import SIZE, Viewpoint

# left and top of a window [pixels], and the coverage of each of its pixels in [0, 255]
Coverage = tuple[int, int, NDArray[np.uint8]]


class Prop:
    """Static object at a position (x, z) [metres].

    `colour`, BGR in [0, 255], and `coverage`, in [0, 1], have the size that the object has in the
    image. `foot` is the row of the object's base in these arrays.
    """

    def __init__(self, x: float, z: float, colour: Array, coverage: Array, foot: float) -> None:
        self.x, self.z = x, z
        self._sprite = Sprite(colour, coverage)
        self._alpha = np.round(coverage * 255).astype(np.uint8)
        self._rise = foot - coverage.shape[0] / 2

    def middle(self, camera: Viewpoint) -> tuple[float, float]:
        """Return the position of the object's centre in the image [pixels]."""
        return (float(camera.column(self.x, self.z)), float(camera.row(0.0, self.z)) - self._rise)

    def draw(
        self, canvas: NDArray[np.uint8], camera: Viewpoint, motion: float = 0.0, travel: float = 0.0
    ) -> None:
        """Draw the object over a canvas, blurred by the camera's motion during the exposure.

        In this time, the camera moves by `travel` [metres] and its turn shifts the image
        horizontally by `motion` [pixels].
        """
        x, y = self.middle(camera)
        reach = self._sprite.width / 2 + abs(motion) + abs(travel) * float(camera.scale(self.z))
        if not -reach < x < canvas.shape[1] + reach:
            return
        displacement = motion - travel * float(camera.scale(self.z))
        moments = instants(displacement)
        centres = np.stack([x + moments * displacement, np.full(len(moments), y)], axis=1)
        self._sprite.draw(canvas, centres, 1.0)

    def coverage(self, camera: Viewpoint) -> Coverage:
        """Return the silhouette, at a position rounded to whole pixels."""
        x, y = self.middle(camera)
        height, width = self._alpha.shape
        return round(x - width / 2), round(y - height / 2), self._alpha


def coverage_extents(coverage: Coverage) -> Array:
    """Return the box around all pixels that are covered at least by half, shape (4,)."""
    left, top, alpha = coverage
    rows, columns = (np.flatnonzero((alpha >= 128).any(axis=axis)) for axis in (1, 0))
    corner = [left + columns[0], top + rows[0]]
    return np.array([*corner, columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]], np.float64)


def visible_part(target: Coverage, nearer: Iterable[Coverage]) -> Coverage:
    """Return the part of the target inside the image that nearer silhouettes do not occlude."""
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
    """Return the coverage that remains visible behind another coverage, in [0, 255]."""
    return ((alpha.astype(np.uint16) * (255 - cover.astype(np.uint16)) + 127) // 255).astype(
        np.uint8
    )


Window = tuple[slice, slice]


def _common(first_coverage: Coverage, second_coverage: Coverage) -> tuple[Window, Window] | None:
    """Return rows and columns of the overlap of two windows, relative to each window."""
    coverages = first_coverage, second_coverage
    left, top = (max(item[side] for item in coverages) for side in (0, 1))
    right, bottom = (
        min(item[side] + item[2].shape[1 - side] for item in coverages) for side in (0, 1)
    )
    if left >= right or top >= bottom:
        return None
    first, second = (
        (slice(top - item[1], bottom - item[1]), slice(left - item[0], right - item[0]))
        for item in coverages
    )
    return first, second
