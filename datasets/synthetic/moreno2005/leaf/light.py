"""Sun and sky: what falls on leaves when the sun is out, and when a cloud is before it."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.path import smooth_step
from datasets.synthetic.render.texture import fractal

__all__ = ["BEHIND_CLOUD", "SKY", "SUN", "Dapples", "drawn_sun", "fallen"]

Array = NDArray[np.float64]

SKY, SUN = np.array([0.78, 0.65, 0.53]), np.array([0.98, 1.42, 1.60])
"""Light of the sky from all around, and of the sun on what faces it, BGR."""

BEHIND_CLOUD = 0.04
"""What a cloud leaves of the sun."""

THROUGH = 0.35
"""Part of the sun's light that comes through a leaf."""

SIDE = 512


class Dapples:
    """Shade of what is above the picture: the sun comes through in places."""

    def __init__(self, random: np.random.Generator) -> None:
        self._map = smooth_step(fractal(random, SIDE, 8, 32, 0.6), -0.55, 0.45)

    def at(self, points: Array) -> Array:
        """Part of the sun that is seen from points, columns and rows first, in [0, 1]."""
        columns, rows = np.round(points[:, :2].T).astype(np.int64) % SIDE
        return np.asarray(self._map[rows, columns])


def drawn_sun(random: np.random.Generator) -> Array:
    """Direction to the sun: above, aside, on the camera's side; shape (3,)."""
    sun = np.array([random.choice([-1, 1]) * random.uniform(0.3, 0.6), -0.6, 0.65])
    return np.asarray(sun / np.sqrt((sun * sun).sum()))


def fallen(normals: Array, sun: Array, in_sun: Array) -> tuple[Array, Array]:
    """Light on leaves from all around and from the sun, in parts of `SKY` and `SUN`.

    Parameters
    ----------
    normals : ndarray of float64, shape (v, 3)
    sun : ndarray of float64, shape (3,)
        Direction to it.
    in_sun : ndarray of float64, shape (v,)
        Part of the sun that is seen from there.

    Returns
    -------
    two ndarray of float64, shape (v,)
    """
    facing = normals @ sun * np.sign(normals[:, 2])  # of the side that is seen
    lit = np.where(facing > 0, facing, -THROUGH * facing)
    return 0.75 + 0.25 * np.abs(normals[:, 2]), in_sun * lit
