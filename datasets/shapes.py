"""Ground-truth polygons and masks; masks are stored as lengths of runs of pixels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

# Polygon, shape (k, 2), or mask, bool of shape (height, width); None if only the box is known.
Shape: TypeAlias = NDArray[np.float64] | NDArray[np.bool_] | None


@dataclass(frozen=True)
class EncodedMask:
    """Mask in a rectangle of the image, as lengths of alternating runs outside and inside.

    Raises `ValueError` for runs that do not fill the rectangle.
    """

    x: int
    y: int
    width: int
    height: int
    runs: NDArray[np.int64]

    def __post_init__(self) -> None:
        pixels = int(self.runs.sum())
        if pixels != self.width * self.height or (self.runs < 0).any():
            raise ValueError(f"the runs have {pixels} pixels. Expected: {self.width}x{self.height}")

    def pixels(self) -> NDArray[np.bool_]:
        """Return the mask inside the rectangle, shape (height, width)."""
        inside = np.arange(len(self.runs)) % 2 == 1
        return np.repeat(inside, self.runs).reshape(self.height, self.width)

    def box(self) -> list[float]:
        """Return the smallest box around the pixels of the mask; NaN for an empty mask."""
        if not self.runs[1::2].any():
            return [np.nan] * 4
        pixels = self.pixels()
        (top, bottom), (left, right) = (
            np.flatnonzero(pixels.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0)
        )
        return [self.x + left, self.y + top, right - left + 1, bottom - top + 1]

    def decode(self, size: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the mask of an image of this width and height."""
        mask = np.zeros(size[::-1], np.bool_)
        mask[self.y : self.y + self.height, self.x : self.x + self.width] = self.pixels()
        return mask


class Shapes(Sequence[Shape]):
    """Polygon or mask of each frame; masks are decoded on access.

    Parameters
    ----------
    shapes : mapping of int to array of shape (k, 2) or EncodedMask
        Polygon or mask by frame; for other frames, only the box is known.
    frames : sequence of int
        Selected frames in order.
    size : tuple of int
        Width and height of the images [pixels]; needed only for masks.
    """

    def __init__(
        self,
        shapes: Mapping[int, NDArray[np.float64] | EncodedMask],
        frames: Sequence[int],
        size: tuple[int, int] = (0, 0),
    ) -> None:
        self._shapes, self._frames, self._size = shapes, frames, size

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> Shape: ...

    @overload
    def __getitem__(self, index: slice) -> "Shapes": ...

    def __getitem__(self, index: int | slice) -> "Shape | Shapes":
        """Return the shape of a frame, or the shapes of a slice of the frames."""
        if isinstance(index, slice):
            return Shapes(self._shapes, self._frames[index], self._size)
        shape = self._shapes.get(self._frames[index])
        return shape.decode(self._size) if isinstance(shape, EncodedMask) else shape

    def mask(self, frame: int) -> NDArray[np.bool_] | None:
        """Return the mask of a frame, or None if its shape is not a mask."""
        shape = self._shapes.get(self._frames[frame])
        return shape.decode(self._size) if isinstance(shape, EncodedMask) else None

    def extended(self, n: int) -> "Shapes":
        """Return the shapes of n frames, at least as many as before; further frames have none."""
        return Shapes(self._shapes, [*self._frames, *[-1] * (n - len(self))], self._size)

    def as_stored(self) -> list[NDArray[np.float64] | EncodedMask | None]:
        """Return the shape of each frame; masks remain encoded."""
        return [self._shapes.get(frame) for frame in self._frames]
