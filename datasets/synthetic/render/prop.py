"""Things that stand in the street, painted once; silhouettes, and what of them is seen."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.sprite import Sprite, instants
from trackmark.datasets.synthetic.render.views import SIZE, Viewpoint

Array = NDArray[np.float64]

Coverage = tuple[int, int, NDArray[np.uint8]]
"""Left and top [pixels], and how far each pixel is covered, in [0, 255]."""


class Prop:
    """A thing that stands at a place (x, z) [metres].

    `colour`, BGR in [0, 255], and `coverage` in [0, 1] are of the size in which it is seen at its
    depth; `foot` is the row at which it stands [pixels from its upper end].
    """

    def __init__(self, x: float, z: float, colour: Array, coverage: Array, foot: float) -> None:
        self.x, self.z = x, z
        self._sprite = Sprite(colour, coverage)
        self._alpha = np.round(coverage * 255).astype(np.uint8)
        self._rise = foot - coverage.shape[0] / 2

    def middle(self, camera: Viewpoint) -> tuple[float, float]:
        """Where the picture's middle is seen [pixels]."""
        return (
            float(camera.column(self.x, self.z)),
            float(camera.row(0.0, self.z)) - self._rise,
        )

    def draw(
        self, canvas: NDArray[np.uint8], camera: Viewpoint, motion: float = 0.0, travel: float = 0.0
    ) -> None:
        """Draw it over a canvas, blurred by the camera's motion during the exposure.

        `motion` is the sideways shift of the whole picture [pixels], `travel` the camera's way
        [metres].
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
        """Silhouette to the nearest pixel."""
        x, y = self.middle(camera)
        height, width = self._alpha.shape
        return round(x - width / 2), round(y - height / 2), self._alpha


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
