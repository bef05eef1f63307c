"""Something that moves: a flat picture of it, parallel to the camera's, and what it shades."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.nguyen2002.lights.plan import SIZE

__all__ = ["Card", "Pose", "Shade"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FINE = 2
"""Samples a pixel in which a card is laid into the picture, in either direction."""


class Pose:
    """Where a card is.

    Parameters
    ----------
    place : array of float64, shape (2,)
        Of its anchor [pixels].
    scale : float
    tilt : float
        To the right [radians].
    """

    def __init__(self, place: ArrayLike, scale: float = 1.0, tilt: float = 0.0) -> None:
        self._place = np.asarray(place, np.float64)
        self._scale = scale
        self._turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])

    def onto_picture(self, points: Array) -> Array:
        """From the card, counted from its anchor, to the picture [pixels]; shape (n, 2)."""
        return np.asarray(self._place + self._scale * points @ self._turn.T)

    def onto_card(self, anchor: Array, fine: int) -> Array:
        """From a place in the picture to that among the card's samples, shape (2, 3)."""
        back = fine / self._scale * self._turn.T
        return np.column_stack([back, fine * anchor - back @ self._place - 0.5])


class Card:
    """Sheets that lie on one another, around a point of them.

    Parameters
    ----------
    sheets : sequence of ndarray of float32, shape (fine * h, fine * w, 4)
        Premultiplied by the coverage, which is the last channel of the first.
    anchor : array of float64, shape (2,)
        The point by which it is placed, from its left top corner [pixels].
    fine : int
        Samples a pixel, in either direction.
    """

    def __init__(self, sheets: Sequence[Floats], anchor: ArrayLike, fine: int) -> None:
        self._sheets = sheets
        self._anchor = np.asarray(anchor, np.float64)
        self._fine = fine

    def at(self, pose: Pose) -> list[Floats]:
        """Its sheets as they lie in the picture, each of shape (height, width, 4)."""
        matrix = pose.onto_card(self._anchor, self._fine)
        matrix[:, 2] += matrix[:, :2] @ np.full(2, 0.5 / FINE)
        matrix[:, :2] /= FINE
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = FINE * SIZE[0], FINE * SIZE[1]
        laid = [cv2.warpAffine(sheet, matrix, size, flags=flags) for sheet in self._sheets]
        return [
            np.asarray(cv2.resize(sheet, SIZE, interpolation=cv2.INTER_AREA), np.float32)
            for sheet in laid
        ]

    def shade(self, softness: float = 0.0) -> "Shade":
        """What it covers, its edges softened by a standard deviation [pixels]."""
        coverage = self._sheets[0][..., 3]
        if not softness:
            return Shade(coverage, self._anchor, self._fine)
        margin = round(3 * softness) * self._fine
        soft = cv2.GaussianBlur(np.pad(coverage, margin), (0, 0), softness * self._fine)
        return Shade(np.asarray(soft), self._anchor + margin / self._fine, self._fine)


class Shade:
    """What a card covers, to be asked for at any points; arguments as of `Card`."""

    def __init__(self, coverage: Floats, anchor: Array, fine: int) -> None:
        self._coverage = coverage
        self._anchor = anchor
        self._fine = fine

    def at(self, pose: Pose, points: Floats) -> Floats:
        """Coverage in [0, 1] at points of the picture.

        Parameters
        ----------
        pose : Pose
            Of the card.
        points : ndarray of float32, shape (h, w, 2)
            Columns and rows [pixels].
        """
        places = cv2.transform(points, pose.onto_card(self._anchor, self._fine))
        columns, rows = (np.ascontiguousarray(places[..., k]) for k in (0, 1))
        return np.asarray(cv2.remap(self._coverage, columns, rows, cv2.INTER_LINEAR), np.float32)
