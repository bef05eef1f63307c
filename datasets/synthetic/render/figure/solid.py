"""Solids of the body: closed surfaces on a grid, with a texture wrapped around."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["AROUND", "Solid", "loft", "turns"]

Array = NDArray[np.float64]

AROUND = 256
"""Columns of a texture, once around; column 0 is the front, a quarter further the left."""


@dataclass(frozen=True)
class Solid:
    """A part of the body, in its own frame: x to the left, y up, z forward.

    Attributes
    ----------
    surface : ndarray of float64, shape (rows, AROUND + 1, 3)
        Where each texel lies, from one end to the other [metres]; the last column is the
        first. A mesh is made of every so many rows, the first and the last among them.
    texture : ndarray of float64, shape (rows, AROUND, 3)
        BGR in [0, 255].
    spacing : tuple of int
        Texels between two vertices of the mesh, down and around.
    """

    surface: Array
    texture: Array
    spacing: tuple[int, int]

    @property
    def vertices(self) -> Array:
        """Vertices of the mesh on their grid, shape (r, a, 3)."""
        down, around = self.spacing
        return self.surface[::down, ::around]

    @property
    def normals(self) -> Array:
        """Outward directions at the vertices, shape (r, a, 3)."""
        grid = self.vertices
        along = np.gradient(grid, axis=0)
        ring = np.concatenate([grid[:, -2:-1], grid, grid[:, 1:2]], axis=1)
        across = ring[:, 2:] - ring[:, :-2]
        normal = np.cross(along, across)
        return np.asarray(normal / (np.sqrt((normal * normal).sum(axis=2, keepdims=True)) + 1e-12))


def turns(rows: int) -> tuple[Array, Array]:
    """How far down (0 to 1) and how far around (radians from the front) each texel lies."""
    down = np.linspace(0, 1, rows)[:, None] * np.ones(AROUND + 1)
    around = np.ones((rows, 1)) * np.linspace(0, 2 * np.pi, AROUND + 1)
    return down, around


def loft(rows: int, profile: ArrayLike, power: float = 2.0) -> Array:
    """Surface through ellipses one below the other, shape (rows, AROUND + 1, 3).

    Parameters
    ----------
    rows : int
        Of the texture.
    profile : array of float64, shape (k, 6)
        Evenly spaced along the texture: height, half width, reach to the front and to the
        back, how much higher the front lies than the middle, shift forward [metres].
    power : float
        2 makes ellipses, more makes them rounded rectangles.
    """
    knots = np.asarray(profile, np.float64)
    place = np.linspace(0, len(knots) - 1, rows)
    columns = [_smoothed(np.interp(place, np.arange(len(knots)), knot), rows) for knot in knots.T]
    height, width, front, back, tilt, shift = (column[:, None] for column in columns)
    _, angle = turns(rows)
    left, forward = np.sin(angle), np.cos(angle)
    norm = (np.abs(left) ** power + np.abs(forward) ** power) ** (1 / power)
    left, forward = left / norm, forward / norm
    reach = np.where(forward > 0, front, back)
    return np.stack([width * left, height + tilt * forward, shift + reach * forward], axis=2)


def _smoothed(values: Array, rows: int) -> Array:
    """Rounded where the knots would be seen; the ends stay."""
    reach = rows // 24
    weights = np.hanning(2 * reach + 3)[1:-1]
    padded = np.pad(values, reach, mode="reflect", reflect_type="odd")
    return np.convolve(padded, weights / weights.sum(), "valid")
