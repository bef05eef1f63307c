"""What is too far to move when the camera does: sky, a town, trees before it."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.view import View
from datasets.synthetic.render.layers import draw_rows
from datasets.synthetic.render.street.facades import backdrop
from datasets.synthetic.render.texture import fractal

__all__ = ["Panorama"]

_DISTANCE = 150.0  # of the town [metres]
_BELOW = 6  # rows that reach under the horizon


class Panorama:
    """A picture around the camera.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws everything.
    focal : float
        [pixels].
    yaws : tuple of float
        Lowest and highest direction of sight [radians].
    width, height : int
        Of the images [pixels].
    """

    def __init__(
        self,
        random: np.random.Generator,
        focal: float,
        yaws: tuple[float, float],
        width: int,
        height: int,
    ) -> None:
        self._start = yaws[0]
        self._focal = focal
        around = int(np.ceil((yaws[1] - yaws[0]) * focal)) + width + 4
        self._base = height
        picture = backdrop(random, height + _BELOW, around, focal / _DISTANCE, float(height))
        self._picture = _with_trees(random, picture, height, focal / 90.0)

    def draw(self, canvas: NDArray[np.uint8], view: View) -> int:
        """Fill all rows down to the horizon and a few below it; how many these are."""
        last = int(np.clip(np.ceil(view.horizon) + _BELOW, 0, len(canvas)))
        left = np.round((view.yaw - self._start) * self._focal * 64)
        lefts = np.full((1, len(self._picture)), left, np.int64)
        top = round((view.horizon - self._base) * 64)
        draw_rows(canvas, self._picture, top, lefts, 0, last)
        return last


def _with_trees(
    random: np.random.Generator, picture: NDArray[np.uint8], base: int, metre: float
) -> NDArray[np.uint8]:
    """A picture with trees along its base; `metre` is in pixels."""
    columns = np.arange(picture.shape[1])
    outline = fractal(random, 256, 4, 128, 0.7)
    leaves = fractal(random, 256, 32, 128, 0.9)
    tops = base - metre * (4.2 + 2.6 * outline[7, columns % 256] + 1.2 * outline[99, columns // 3
                                                                            % 256])  # fmt: skip
    rows = np.arange(len(picture))[:, None]
    cover = np.clip(rows - tops, 0, 1)
    tone = 1 + 0.3 * leaves[rows % 256, columns % 256] - 0.2 * np.clip((rows - tops) / 30, 0, 1)
    green = np.array([72.0, 104.0, 88.0]) * tone[..., None]
    return np.asarray(picture + (green - picture) * cover[..., None]).astype(np.uint8)
