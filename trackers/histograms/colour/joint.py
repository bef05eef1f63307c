"""Joint bins of three colour channels, RGB or HSV: one bin a pixel."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.interface import Image
from trackers.histograms.colour.lookup import ColourTable, colour_table, looked_up

__all__ = ["ColourSpace", "JointBins"]

ColourSpace: TypeAlias = Literal["rgb", "hsv"]


@dataclass(frozen=True)
class JointBins:
    """A way to bin colours; equal ones can share their work on a frame.

    Attributes
    ----------
    space : {'rgb', 'hsv'}
        'rgb': R, G and B each divided evenly. 'hsv': H and S so, V into half as many bins.
        Hue and saturation are those of OpenCV's 8-bit conversion.
    bins : int
        A channel, in [2, 32].
    """

    space: ColourSpace = "rgb"
    bins: int = 8

    @property
    def n_bins(self) -> int:
        """Number of bins that there are."""
        return self.bins**3 if self.space == "rgb" else self.bins**2 * (self.bins // 2)

    def codes(self, image: Image, transposed: bool = False) -> NDArray[np.uint16]:
        """Bin of each pixel of an image or of a window of one.

        Parameters
        ----------
        image : ndarray of uint8, shape (height, width, 3)
            BGR.
        transposed : bool
            Give them by column: regions that are higher than wide are read in longer runs.

        Returns
        -------
        ndarray of uint16, shape (height, width), or (width, height) where transposed
            With R, G, B (or H, S, V) in the order of significance.
        """
        if self.space == "rgb":
            codes = _rgb_codes(image, _divided(self.bins), self.bins)
        else:
            codes = looked_up(image, _hsv_table(self.bins))
        return np.ascontiguousarray(codes.T) if transposed else codes


@lru_cache
def _divided(bins: int) -> NDArray[np.uint16]:
    """Bin of every byte."""
    return (np.arange(256) * bins // 256).astype(np.uint16)


@njit(cache=True)
def _rgb_codes(image: Image, of_byte: NDArray[np.uint16], bins: int) -> NDArray[np.uint16]:
    height, width, _ = image.shape
    green, red = of_byte * np.uint16(bins), of_byte * np.uint16(bins * bins)
    found = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it.
            found[row, column] = (
                of_byte[np.uintp(image[row, column, 0])]
                + green[np.uintp(image[row, column, 1])]
                + red[np.uintp(image[row, column, 2])]
            )
    return found


@lru_cache
def _hsv_table(bins: int) -> ColourTable:
    """Bin of every colour; a tenth of a second or two to make."""

    def codes(image: Image) -> NDArray[np.uint16]:
        hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 2, 0)
        half = bins // 2
        found: NDArray[np.uint16] = hue.astype(np.uint16) * bins // 180 * (bins * half)
        found += saturation.astype(np.uint16) * bins // 256 * half
        found += value.astype(np.uint16) * half // 256
        return found

    return colour_table(codes)
