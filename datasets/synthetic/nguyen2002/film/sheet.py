"""Pictures of single things: painted finely, with what they cover said apart."""

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.painting import Painting
from datasets.synthetic.render.texture import fractal

__all__ = ["UNIT", "Sheet"]

Array = NDArray[np.float64]

UNIT = 100.0
"""Scale of what is painted as large as it is seen [pixels/metre]; not the world's metres."""

FINE = 3
"""Painted pixels per pixel of the picture."""


class Sheet:
    """A thing in front of nothing.

    Parameters
    ----------
    width, height : float
        [metres].
    scale : float
        [pixels/metre].
    colour : array of float64, shape (3,)
        BGR in [0, 255] of what isn't painted over.

    Attributes
    ----------
    painting : Painting
        To paint on, beyond the thing's outline too.
    anchor : tuple of float
        The point by which it is placed, its middle at first [metres].
    """

    def __init__(self, width: float, height: float, scale: float, colour: ArrayLike) -> None:
        self._size = max(round(width * scale), 1), max(round(height * scale), 1)
        fine = np.empty((self._size[1] * FINE, self._size[0] * FINE, 3), np.uint8)
        fine[:] = np.clip(np.asarray(colour), 0, 255)
        self.painting = Painting(fine, FINE * scale)
        self.anchor = width / 2, height / 2
        self._coverage = np.zeros(fine.shape[:2], np.uint8)

    def cover(self, *outline: tuple[float, float]) -> None:
        """Say that the thing covers the inside of an outline [metres]."""
        points = np.round(np.array(outline) * self.painting.scale * 16).astype(np.int32)
        cv2.fillPoly(self._coverage, [points], 255, shift=4)

    def cover_box(self, x: float, y: float, width: float, height: float) -> None:
        """Say that the thing covers a rectangle [metres]."""
        self.cover((x, y), (x + width, y), (x + width, y + height), (x, y + height))

    def cover_round(self, x: float, y: float, half_width: float, half_height: float) -> None:
        """Say that the thing covers an ellipse [metres]."""
        turn = np.linspace(0, 2 * np.pi, 97)[:-1]
        along, across = x + half_width * np.cos(turn), y + half_height * np.sin(turn)
        self.cover(*zip(along.tolist(), across.tolist(), strict=True))

    def places(self) -> tuple[Array, Array]:
        """Where the painted pixels are: across and down, in [0, 1]."""
        height, width = self._coverage.shape
        across, down = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
        return np.broadcast_to(across, (height, width)), np.broadcast_to(
            down[:, None], (height, width)
        )

    def light(self, gain: Array) -> None:
        """Change the light on it; `gain` has the shape of `places` or broadcasts to it."""
        picture = self.painting.picture
        picture[:] = np.clip(np.round(picture * gain[..., None]), 0, 255).astype(np.uint8)

    def wear(
        self,
        random: np.random.Generator,
        strength: float,
        coarsest: int,
        finest: int,
        stretch: int = 1,
        side: int = 256,
    ) -> None:
        """Roughen it: grain of so many cells in `side` painted pixels, drawn out downwards."""
        grain = fractal(random, side, coarsest, finest, 0.75)
        rows, columns = (np.arange(size) for size in self._coverage.shape)
        self.light(1 + strength * grain[np.ix_(rows // stretch % side, columns % side)])

    def reduced(self) -> tuple[Array, Array]:
        """Colour (h, w, 3) in [0, 255] and coverage (h, w) in [0, 1], as the picture has them."""
        colour = cv2.resize(self.painting.picture, self._size, interpolation=cv2.INTER_AREA)
        coverage = cv2.resize(self._coverage, self._size, interpolation=cv2.INTER_AREA)
        return colour.astype(np.float64), coverage / 255
