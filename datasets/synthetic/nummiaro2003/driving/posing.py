"""Where solids are for a camera, and how much light falls on their facets."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.facets import Facets, Lens, Pose
from datasets.synthetic.nummiaro2003.driving.view import View, heading_axes
from datasets.synthetic.render.street.ground import PERIOD, SLANT_X, SLANT_Z

__all__ = ["NEAREST", "SHADE_SIDE", "extents", "posed"]

NEAREST = 0.6
"""Solids that come nearer to the camera than this have no extents [metres]."""

SHADE_SIDE = 512
"""Of the picture of shade, which covers PERIOD metres [pixels]."""

_SKY = np.array([-0.05, 0.23, -0.08, 0.8])  # brightest above, and somewhat to the left
_DENSITY = SHADE_SIDE / PERIOD * np.array([[1.0, SLANT_X, 0.0], [0.0, SLANT_Z, 1.0]])


def posed(
    view: View, facets: Facets, place: tuple[float, float, float] = (0, 0, 0), heading: float = 0.0
) -> Pose:
    """Pose of a solid that stands at a place, its axis in a heading."""
    eye, axes = np.array(view.place), heading_axes(heading)
    return _pose(view.turn, eye, axes, np.array(place, float), facets.normals, _SKY, _DENSITY)


@njit(cache=True)
def _pose(
    view: NDArray[np.float64],
    eye: NDArray[np.float64],
    axes: NDArray[np.float64],
    place: NDArray[np.float64],
    normals: NDArray[np.float64],
    sky: NDArray[np.float64],
    density: NDArray[np.float64],
) -> Pose:
    """Pose of a solid for a camera.

    Parameters
    ----------
    view : ndarray of float64, shape (3, 3)
        From the world's axes to the camera's.
    eye : ndarray of float64, shape (3,)
        The camera's place [metres].
    axes : ndarray of float64, shape (3, 3)
        From the solid's axes to the world's.
    place : ndarray of float64, shape (3,)
        Of the solid's origin [metres].
    normals : ndarray of float64, shape (n, 3)
        Of its facets, in its own frame.
    sky : ndarray of float64, shape (4,)
        Light on a facet: factors of its normal in the world, and a constant.
    density : ndarray of float64, shape (2, 3)
        Column and row in the picture of shade, as factors of a place in the world.
    """
    turn, apart, shading = np.zeros((3, 3)), np.zeros(3), np.zeros((2, 4))
    for i in range(3):
        for k in range(3):
            for j in range(3):
                turn[i, j] += view[i, k] * axes[k, j]
            apart[i] += view[i, k] * (place[k] - eye[k])
    for i in range(2):
        for k in range(3):
            for j in range(3):
                shading[i, j] += density[i, k] * view[j, k]
            shading[i, 3] += density[i, k] * eye[k]
    gains = np.empty(len(normals), np.int64)
    for f in range(len(normals)):
        gain = sky[3]
        for k in range(3):
            for j in range(3):
                gain += sky[k] * axes[k, j] * normals[f, j]
        gains[f] = np.int64(np.floor(gain * 256 + 0.5))
    return Pose(turn, apart, gains, shading)


@njit(cache=True)
def extents(facets: Facets, pose: Pose, lens: Lens) -> tuple[float, float, float, float, float]:
    """Lowest and highest column and row of a solid's corners, and the nearest one's depth.

    Where one of them is not clearly before the camera, columns and rows are 0.
    """
    turn, place = pose.turn, pose.place
    nearest = np.inf
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for f in range(len(facets.counts)):
        for k in range(facets.counts[f]):
            x, y, z = facets.corners[f, k]
            ahead = place[2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
            nearest = min(nearest, ahead)
            if nearest < NEAREST:
                return 0.0, 0.0, 0.0, 0.0, nearest
            across = place[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
            down = place[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
            column = lens.column + lens.focal * across / ahead
            row = lens.row + lens.focal * down / ahead
            left, right = min(left, column), max(right, column)
            top, bottom = min(top, row), max(bottom, row)
    return left, right, top, bottom, nearest
