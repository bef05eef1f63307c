"""Things painted at several times the picture's resolution, lit by one lamp."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.sprite import Sprite
from datasets.synthetic.render.texture import fractal

__all__ = ["FINE", "Paint"]

Array = NDArray[np.float64]

FINE = 4
"""Painted pixels per pixel of the picture."""


class Paint:
    """A transparent sheet on which one thing is painted over the other.

    Places and lengths are in millimetres, counted from a point of the sheet.

    Parameters
    ----------
    size : tuple of int
        Width and height of the sheet [pixels].
    origin : tuple of float
        From where places are counted: right and down of the sheet's corner [pixels].
    scale : float
        [pixels/millimetre].
    lamp : ndarray of float64, shape (3,)
        Direction to the light: right, down, to the camera; of unit length.
    """

    def __init__(
        self, size: tuple[int, int], origin: tuple[float, float], scale: float, lamp: Array
    ) -> None:
        self._lamp, self._scale = lamp, scale
        rows, columns = np.indices((size[1] * FINE, size[0] * FINE))
        self.x = ((columns + 0.5) / FINE - origin[0]) / scale
        self.y = ((rows + 0.5) / FINE - origin[1]) / scale
        self._colour = np.zeros((*self.x.shape, 3))
        self._coverage = np.zeros(self.x.shape)

    def sprite(self, side: int) -> Sprite:
        """What was painted; mirrored for the side -1."""
        return Sprite(self._colour[:, ::side], self._coverage[:, ::side])

    def grain(
        self, random: np.random.Generator, coarsest: int, finest: int, stretch: float = 1.0
    ) -> Array:
        """Noise over the sheet, about in [-1, 1], of so many cells in 512 painted pixels.

        `stretch` draws it out sideways.
        """
        noise = fractal(random, 512, coarsest, finest, 0.8)
        rows, columns = np.indices(self.x.shape)
        return np.asarray(noise[rows % 512, (columns / stretch).astype(np.int64) % 512])

    def inside(self, distance: Array) -> Array:
        """Coverage where a distance to the outline is positive [millimetres]."""
        return np.asarray(np.clip(distance * self._scale * FINE + 0.5, 0, 1))

    def tube(
        self,
        points: ArrayLike,
        radii: ArrayLike,
        colour: ArrayLike,
        *,
        bumps: Array | float = 1.0,
        edge: float = 0.0,
    ) -> None:
        """A round limb: the hull of balls along a line.

        Parameters
        ----------
        points : array of float64, shape (k, 2)
            Middles of the balls.
        radii : array of float64, shape (k,)
            Theirs; linear in between.
        colour : array of float64, shape (3,)
            BGR in [0, 255].
        bumps : ndarray of float64, shape (rows, columns), optional
            Gain of light over the sheet: folds, grain.
        edge : float
            How much darker the outline is, in [0, 1]: sets off what lies on its like.
        """
        points, radii = np.asarray(points, np.float64), np.asarray(radii, np.float64)
        depth, radius = np.full(self.x.shape, np.inf), np.ones_like(self.x)
        right, down = np.zeros_like(self.x), np.zeros_like(self.x)
        for k in range(len(points) - 1):
            step = points[k + 1] - points[k]
            u, v = self.x - points[k, 0], self.y - points[k, 1]
            along = np.clip((u * step[0] + v * step[1]) / (step * step).sum(), 0, 1)
            r = radii[k] + along * (radii[k + 1] - radii[k])
            u, v = (u - along * step[0]) / r, (v - along * step[1]) / r
            here = np.sqrt(u * u + v * v)
            nearer = here < depth
            for whole, part in ((depth, here), (right, u), (down, v), (radius, r)):
                whole[nearer] = part[nearer]
        forward = np.sqrt(np.clip(1 - depth * depth, 0, 1))
        lit = right * self._lamp[0] + down * self._lamp[1] + forward * self._lamp[2]
        rim = np.square(np.clip(depth, 0, 1))
        light = (0.48 + 0.66 * np.clip(lit, 0, 1)) * (1 - edge * rim * rim) * bumps
        cover = self.inside((1 - depth) * radius)
        self.lay(np.asarray(colour, np.float64) * light[..., None], cover)

    def lay(self, colour: Array, coverage: Array) -> None:
        """Lay a thing over what is there."""
        below = self._coverage * (1 - coverage)
        total = coverage + below
        mixed = colour * coverage[..., None] + self._colour * below[..., None]
        self._colour = mixed / np.maximum(total, 1e-9)[..., None]
        self._coverage = total

    def shade(self, gain: Array) -> None:
        """Change the light on what is there."""
        self._colour = self._colour * gain[..., None]
