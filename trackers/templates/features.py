"""What a template holds of a pixel: intensity, colour, or what is left of colour in any light."""

from math import atan
from typing import Literal, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.interface import Image

__all__ = ["FLOORS", "Features", "dimension", "features_of"]

Array = NDArray[np.float64]
Features: TypeAlias = Literal["invariants", "arctan", "rgb", "intensity"]

FLOORS: dict[Features, float] = {"intensity": 3.0, "rgb": 1.0, "invariants": 1e-4, "arctan": 1e-4}
"""Least variance of any component of a residual: that of rounding to whole grey levels."""

_RATIOS = np.arange(256.0)[:, np.newaxis] / np.maximum(np.arange(256.0), 1.0)
_ANGLES = np.vectorize(atan)(_RATIOS)


def dimension(kind: Features) -> int:
    """Number d of components."""
    return 1 if kind == "intensity" else 3


def features_of(image: Image, kind: Features) -> Array:
    """Features of every pixel of a BGR image, float64 of shape (rows, columns, d).

    `intensity` is R + G + B; `rgb` is (R, G, B); `invariants` are the ratios c1 = R / max(G, B),
    c2 = G / max(B, R) and c3 = B / max(R, G) (equation 18), a largest of 0 counting as one grey
    level; `arctan` are their arc tangents, as Gevers & Smeulders define them.
    """
    if kind == "intensity":
        return _intensities(image)
    if kind == "rgb":
        return _colours(image)
    return _ratios(image, _RATIOS if kind == "invariants" else _ANGLES)


@njit(cache=True)
def _intensities(image: Image) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 1))
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            found[row, column, 0] = float(blue) + float(green) + float(red)
    return found


@njit(cache=True)
def _colours(image: Image) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 3))
    for row in range(rows):
        for column in range(columns):
            for channel in range(3):
                found[row, column, channel] = image[row, column, 2 - channel]
    return found


@njit(cache=True)
def _ratios(image: Image, table: Array) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 3))
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            found[row, column, 0] = table[red, max(green, blue)]
            found[row, column, 1] = table[green, max(blue, red)]
            found[row, column, 2] = table[blue, max(red, green)]
    return found
