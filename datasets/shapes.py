"""True outlines of a target: polygons, and masks as runs of pixels; whole masks when asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

# A polygon, shape (k, 2), a mask, bool of shape (height, width), or None where the box is all.
Shape: TypeAlias = NDArray[np.float64] | NDArray[np.bool_] | None


@dataclass(frozen=True)
class EncodedMask:
    """Where a mask's part of the image lies, and runs of pixels outside and inside in turn.

    Raises `ValueError` for runs that do not fill the part.
    """

    x: int
    y: int
    width: int
    height: int
    runs: NDArray[np.int64]

    def __post_init__(self) -> None:
        pixels = int(self.runs.sum())
        if pixels != self.width * self.height or (self.runs < 0).any():
            raise ValueError(f"the runs make {pixels} pixels, not {self.width}x{self.height}")

    def pixels(self) -> NDArray[np.bool_]:
        """Its part of the image, shape (height, width)."""
        inside = np.arange(len(self.runs)) % 2 == 1
        return np.repeat(inside, self.runs).reshape(self.height, self.width)

    def box(self) -> list[float]:
        """The smallest box around its pixels; NaN where there is none."""
        if not self.runs[1::2].any():
            return [np.nan] * 4
        pixels = self.pixels()
        (top, bottom), (left, right) = (
            np.flatnonzero(pixels.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0)
        )
        return [self.x + left, self.y + top, right - left + 1, bottom - top + 1]

    def whole(self, size: tuple[int, int]) -> NDArray[np.bool_]:
        """The mask of an image of this width and height, which it lies in."""
        mask = np.zeros(size[::-1], np.bool_)
        mask[self.y : self.y + self.height, self.x : self.x + self.width] = self.pixels()
        return mask


class Shapes(Sequence[Shape]):
    """Outlines by frame; masks are made when they are asked for.

    `known`: By frame; of others the box is all that is known; shape (k, 2), or EncodedMask.
    `frames`: Which of these frames are meant, in order. `size`: Width and height of the images in
    pixels; it is needed for masks alone.
    """

    def __init__(
        self,
        known: Mapping[int, NDArray[np.float64] | EncodedMask],
        frames: Sequence[int],
        size: tuple[int, int] = (0, 0),
    ) -> None:
        self._known, self._frames, self._size = known, frames, size

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> Shape: ...

    @overload
    def __getitem__(self, index: slice) -> "Shapes": ...

    def __getitem__(self, index: int | slice) -> "Shape | Shapes":
        """The outline of a frame, or those of a slice of the frames."""
        if isinstance(index, slice):
            return Shapes(self._known, self._frames[index], self._size)
        one = self._known.get(self._frames[index])
        return one.whole(self._size) if isinstance(one, EncodedMask) else one

    def as_stored(self) -> list[NDArray[np.float64] | EncodedMask | None]:
        """By frame, masks as their runs."""
        return [self._known.get(frame) for frame in self._frames]
