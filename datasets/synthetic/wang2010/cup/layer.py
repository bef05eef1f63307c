"""Something that moves over the picture: carried and tilted, averaged over the exposure."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.wang2010.cup.plan import SIZE

__all__ = ["FINE", "Layer", "smaller"]

FINE = 4
"""Samples a pixel of the picture, in either direction."""


class Layer:
    """A picture that is laid over others, around a point of it.

    Parameters
    ----------
    picture : ndarray of uint8, shape (FINE * h, FINE * w) or (FINE * h, FINE * w, c)
        Zeros where there is nothing; it needn't have the size of what it is laid over.
    anchor : array of float64, shape (2,)
        The point by which it is placed, from its left top corner [pixels].
    """

    def __init__(self, picture: NDArray[np.uint8], anchor: ArrayLike) -> None:
        self._picture = picture
        self._anchor = np.asarray(anchor, np.float64)

    def at(self, place: ArrayLike, tilt: float) -> NDArray[np.float64]:
        """What is seen of it in the picture.

        Parameters
        ----------
        place : array of float64, shape (2,)
            Of its anchor [pixels].
        tilt : float
            To the right [radians].

        Returns
        -------
        ndarray of float64, shape (height, width) or (height, width, c)
            In [0, 1].
        """
        turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
        middle = FINE * np.asarray(place, np.float64) - 0.5
        shift = FINE * self._anchor - 0.5 - turn @ middle
        canvas = FINE * SIZE[0], FINE * SIZE[1]
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        matrix = np.column_stack([turn, shift])
        return smaller(cv2.warpAffine(self._picture, matrix, canvas, flags=flags))

    def extents(
        self, places: NDArray[np.float64], tilts: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Tight boxes around what is there, placed as by `at`, shape (n, 4) [pixels]."""
        rows, columns = np.nonzero(self._picture)
        ends = [(columns + u, rows + v) for u in (0, 1) for v in (0, 1)]
        corners = np.concatenate([np.stack(end, axis=1) for end in ends]).astype(np.int32)
        outline = cv2.convexHull(corners)[:, 0] / FINE - self._anchor
        cosine, sine = np.cos(tilts)[:, None], np.sin(tilts)[:, None]
        x = places[:, :1] + cosine * outline[:, 0] - sine * outline[:, 1]
        y = places[:, 1:] + sine * outline[:, 0] + cosine * outline[:, 1]
        left, top = x.min(axis=1), y.min(axis=1)
        return np.stack([left, top, x.max(axis=1) - left, y.max(axis=1) - top], axis=1)


def smaller(picture: NDArray[Any], fine: int = FINE) -> NDArray[np.float64]:
    """Means over the samples of each pixel, in [0, 1]."""
    height, width = picture.shape[0] // fine, picture.shape[1] // fine
    means = cv2.resize(picture.astype(np.float64), (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(means / 255)
