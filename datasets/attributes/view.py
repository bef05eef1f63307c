"""A frame as attributes are shown it: its picture, the target's box, and the frames it follows."""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image


@dataclass(eq=False)
class View:
    """A frame in which the target is, its box having a size."""

    image: Image  # picture, shape (height, width, 3)
    # truth `[x, y, width, height]` [pixels]; of a polygon or a mask the box around it; shape (4,)
    box: NDArray[np.float64]
    # share of the target that the truth says is seen; NaN where it says nothing
    visibility: float = float("nan")
    before: "View | None" = None  # the frame before, where the target is in it, too
    first: "View | None" = None  # the first frame with the target; None in that frame itself

    @property
    def side(self) -> float:
        """Size of the target: the root of its box's area [pixels]."""
        return sqrt(float(self.box[2] * self.box[3]))

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of the box [pixels]."""
        return np.asarray(self.box[:2] + self.box[2:] / 2)

    @cached_property
    def grey(self) -> NDArray[np.float64]:
        """Grey levels of the pixels in the box, 0 to 255; none where it is out of the image."""
        return self.grey_in(self.box)

    def grey_in(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """Grey levels of the pixels in another box, see `part_of`."""
        part = part_of(self.image, box)
        if part.size == 0:
            return np.empty(part.shape[:2])
        return np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2GRAY), np.float64)

    @property
    def seen(self) -> NDArray[np.float64]:
        """Which part of the box is in the image: left, top, right, bottom, from 0 to 1.

        Where none is, right is not beyond left, or bottom not beyond top.
        """
        size = np.array(self.image.shape[1::-1], np.float64)
        low, high = self.box[:2], self.box[:2] + self.box[2:]
        ends = np.concatenate([np.maximum(low, 0.0), np.minimum(high, size)])
        return np.asarray((ends - np.tile(low, 2)) / np.tile(self.box[2:], 2))


def part_of(image: Image, box: NDArray[np.float64]) -> Image:
    """Pixels of an image whose centres are in a box; what is beyond the border is cut off."""
    x, y, width, height = box.tolist()
    first_column, last_column = (max(0, ceil(end - 0.5)) for end in (x, x + width))
    first_row, last_row = (max(0, ceil(end - 0.5)) for end in (y, y + height))
    return image[first_row:last_row, first_column:last_column]
