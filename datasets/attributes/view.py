"""Target in a frame, linked to the target in the previous and in the first frame."""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image


@dataclass(eq=False)
class TargetView:
    """Target in a frame in which it is present and its box has a size."""

    image: Image
    # shape (4,): ground truth `[x, y, width, height]` [pixels], the box around polygons and masks
    box: NDArray[np.float64]
    visibility: float = float("nan")  # visible fraction in the ground truth; NaN if unknown
    previous: "TargetView | None" = None  # None if the target is absent in the previous frame
    first: "TargetView | None" = None  # first frame with the target; None in that frame

    @property
    def side(self) -> float:
        """Size of the target, which is the square root of the box's area [pixels]."""
        return sqrt(float(self.box[2] * self.box[3]))

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of the box [pixels]."""
        return np.asarray(self.box[:2] + self.box[2:] / 2)

    @cached_property
    def grey(self) -> NDArray[np.float64]:
        """Grey levels of the pixels in the box, 0 to 255; empty outside the image."""
        return self.grey_in(self.box)

    def grey_in(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the grey levels of the pixels in another box; see `part_of`."""
        part = part_of(self.image, box)
        if part.size == 0:
            return np.empty(part.shape[:2])
        return np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2GRAY), np.float64)

    @property
    def visible_part(self) -> NDArray[np.float64]:
        """Part of the box that is inside the image: left, top, right, bottom relative to the box.

        All four are in [0, 1], unless the box is outside: then right <= left or bottom <= top.
        """
        size = np.array(self.image.shape[1::-1], np.float64)
        low, high = self.box[:2], self.box[:2] + self.box[2:]
        ends = np.concatenate([np.maximum(low, 0.0), np.minimum(high, size)])
        return np.asarray((ends - np.tile(low, 2)) / np.tile(self.box[2:], 2))


def part_of(image: Image, box: NDArray[np.float64]) -> Image:
    """Return the pixels of an image whose centres are in a box."""
    x, y, width, height = box.tolist()
    first_column, last_column = (max(0, ceil(end - 0.5)) for end in (x, x + width))
    first_row, last_row = (max(0, ceil(end - 0.5)) for end in (y, y + height))
    return image[first_row:last_row, first_column:last_column]
