"""Flat opaque shapes with straight, round and wavy outlines."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.ellipse.plan import SIZE

__all__ = ["FINE", "Shape", "drawn_shape"]

Array = NDArray[np.float64]

FINE = 3
"""Samples of a painting per pixel and axis; odd, so that the middle one is the pixel's centre."""

SUBPIXEL = 4
"""Binary digits by which OpenCV places outlines between samples."""


@dataclass(frozen=True)
class Shape:
    """What a closed outline surrounds.

    Attributes
    ----------
    outline : ndarray of float64, shape (k, 2)
        [pixels].
    """

    outline: Array

    def samples(self) -> NDArray[np.bool_]:
        """Which samples it covers, shape (height * FINE, width * FINE)."""
        canvas = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
        points = np.round((self.outline * FINE - 0.5) * (1 << SUBPIXEL)).astype(np.int32)
        cv2.fillPoly(canvas, [points], 1, shift=SUBPIXEL)
        return canvas.astype(np.bool_)


def drawn_shape(random: np.random.Generator, centre: Array, radius: float) -> Shape:
    """A shape of any kind around a place.

    Parameters
    ----------
    random : numpy.random.Generator
    centre : ndarray of float64, shape (2,)
        [pixels].
    radius : float
        Of the circle of about the same size [pixels].
    """
    kinds = _box, _polygon, _oval, _blob
    points = kinds[random.integers(len(kinds))](random)
    stretch = np.exp(random.uniform(-0.4, 0.4))
    angle = random.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return Shape(centre + radius * (points * (stretch, 1 / stretch)) @ turn)


def _box(random: np.random.Generator) -> Array:
    return 0.9 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _polygon(random: np.random.Generator) -> Array:
    corners = int(random.integers(3, 7))
    angles = (np.arange(corners) + random.uniform(-0.3, 0.3, corners)) * (2 * np.pi / corners)
    return 1.15 * random.uniform(0.8, 1.2, (corners, 1)) * _directions(angles)


def _oval(random: np.random.Generator) -> Array:
    return _directions(np.linspace(0, 2 * np.pi, 64, endpoint=False))


def _blob(random: np.random.Generator) -> Array:
    angles = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    waves = [
        random.uniform(0, 0.4 / k) * np.sin(k * angles + random.uniform(0, 2 * np.pi))
        for k in range(2, 6)
    ]
    radii: Array = 1 + np.sum(waves, axis=0)
    return radii[:, None] * _directions(angles)


def _directions(angles: Array) -> Array:
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
