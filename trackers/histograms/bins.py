"""Colour bins: joint bins of three channels (RGB or HSV), and bins of CIE L*u*v*.

A table stores OpenCV's 8-bit conversion of every colour. Bins are therefore exactly those of
`cv2.cvtColor`, also for windows of an image.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Codes
from trackmark.trackers.base.interface import Image

ColourSpace: TypeAlias = Literal["rgb", "hsv"]
Binning: TypeAlias = Literal["both", "perez"]
UvRange: TypeAlias = Literal["full", "natural", "srgb-gamut"]

LIGHTNESS_BINS = 10
CHROMATICITY_BINS = 10  # for u* and for v*
N_BINS = CHROMATICITY_BINS**2 + LIGHTNESS_BINS  # of L*u*v*

# Ranges of OpenCV's bytes: u* = byte · 354 / 255 - 134, v* = byte · 262 / 255 - 140.
_BYTE_RANGES = ((-134, 220), (-140, 122))
_RANGES: dict[UvRange, tuple[tuple[int, int], tuple[int, int]]] = {
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}
_GREY_CHROMA = 17.9  # a tenth of the largest √(u*² + v*²) of sRGB, that of red
_GREY = CHROMATICITY_BINS**2  # pseudo chromaticity bin of pixels that only vote for lightness
_CHROMATICITIES = _GREY + 1

_BITS = np.arange(8)
_SPREAD = ((np.arange(256)[:, np.newaxis] >> _BITS & 1) << 3 * _BITS).sum(axis=1).astype(np.uint32)
"""Every byte with its bits three places apart: interleaved channels keep similar colours close."""


def _colour_table(codes: Callable[[Image], Codes]) -> Codes:
    """Return the code of every 8-bit colour, (2²⁴,), 32 MiB; `_SPREAD` channels form the index."""
    plane = np.empty((256, 256, 3), np.uint8)
    plane[..., 1] = np.arange(256)[:, np.newaxis]
    plane[..., 2] = np.arange(256)
    columns = _SPREAD[:, np.newaxis] << 1 | _SPREAD
    table = np.empty(256**3, np.uint16)
    for blue in range(256):
        plane[..., 0] = blue
        table[_SPREAD[blue] << 2 | columns] = codes(plane)
    return table


@njit(cache=True)
def _look_up(image: Image, table: Codes) -> Codes:
    height, width, _ = image.shape
    codes = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it.
            blue = _SPREAD[np.uintp(image[row, column, 0])]
            green = _SPREAD[np.uintp(image[row, column, 1])]
            red = _SPREAD[np.uintp(image[row, column, 2])]
            codes[row, column] = table[np.uintp(blue << 2 | green << 1 | red)]
    return codes


@dataclass(frozen=True)
class JointBins:
    """Joint bins of three channels.

    Trackers with equal bins share the codes of a frame.

    `space` {"rgb", "hsv"}: colour space.
    `bins`: bins per channel, 2 to 32; V of HSV has half as many.
    """

    space: ColourSpace = "rgb"
    bins: int = 8

    @property
    def n_bins(self) -> int:
        """Number of joint bins."""
        return self.bins**3 if self.space == "rgb" else self.bins**2 * (self.bins // 2)

    def codes(self, image: Image, transposed: bool = False) -> Codes:
        """Return the bin of each pixel, (height, width), or (width, height) if `transposed`."""
        if self.space == "rgb":
            codes = _rgb_codes(image, _byte_bins(self.bins), self.bins)
        else:
            codes = _look_up(image, _hsv_table(self.bins))
        return np.ascontiguousarray(codes.T) if transposed else codes


@lru_cache
def _byte_bins(bins: int) -> Codes:
    """Return the bin of every byte, (256,)."""
    return (np.arange(256) * bins // 256).astype(np.uint16)


@njit(cache=True)
def _rgb_codes(image: Image, byte_bins: Codes, bins: int) -> Codes:
    height, width, _ = image.shape
    green, red = byte_bins * np.uint16(bins), byte_bins * np.uint16(bins * bins)
    codes = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it.
            codes[row, column] = (
                byte_bins[np.uintp(image[row, column, 0])]
                + green[np.uintp(image[row, column, 1])]
                + red[np.uintp(image[row, column, 2])]
            )
    return codes


@lru_cache
def _hsv_table(bins: int) -> Codes:
    def codes(image: Image) -> Codes:
        hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 2, 0)
        half = bins // 2
        codes_of_image: Codes = hue.astype(np.uint16) * bins // 180 * (bins * half)
        codes_of_image += saturation.astype(np.uint16) * bins // 256 * half
        codes_of_image += value.astype(np.uint16) * half // 256
        return codes_of_image

    return _colour_table(codes)


@dataclass(frozen=True)
class LuvBins:
    """Bins of CIE L*u*v*: bins 0 to 99 are u* · 10 + v*, bins 100 to 109 are L*.

    The code of a pixel combines its lightness and chromaticity bins. Trackers with equal bins share
    the codes of a frame.

    `binning` {"both", "perez"}: `both`: a pixel votes for both bins. `perez`: it votes for its
      lightness bin only if √(u*² + v*²) < 17.9, otherwise for its chromaticity bin only (rule of
      Pérez et al. 2002, applied to L*u*v*).
    `uv_range` {"full", "natural", "srgb-gamut"}: range of the 10 x 10 chromaticity bins: u* -134 to
      220 and v* -140 to 122 (`full`: range of bytes), -60 to 120 and -80 to 80 (`natural`), or -83
      to 175 and -134 to 107 (`srgb-gamut`). Colours outside belong to the outermost bins.
    """

    binning: Binning = "both"
    uv_range: UvRange = "full"

    def codes(self, image: Image) -> Codes:
        """Return the codes of an image or window, uint16 of shape (height, width)."""
        return _look_up(image, _luv_table(self.binning, self.uv_range))

    @property
    def votes(self) -> NDArray[np.uint8]:
        """Bins that each code votes for, shape (codes, votes per pixel)."""
        return _votes(self.binning)

    @property
    def votes_a_pixel(self) -> int:
        """Number of votes per pixel."""
        return 2 if self.binning == "both" else 1


@lru_cache
def _votes(binning: Binning) -> NDArray[np.uint8]:
    codes = np.arange(LIGHTNESS_BINS * _CHROMATICITIES)
    lightness, chromaticity = _GREY + codes // _CHROMATICITIES, codes % _CHROMATICITIES
    if binning == "both":
        return np.stack([chromaticity, lightness], axis=1).astype(np.uint8)
    only = np.where(chromaticity == _GREY, lightness, chromaticity)
    return only[:, np.newaxis].astype(np.uint8)


@lru_cache
def _luv_table(binning: Binning, uv_range: UvRange) -> Codes:
    lightness, chromaticity = _code_parts(binning, uv_range)

    def codes(image: Image) -> Codes:
        luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
        codes_of_image: Codes = lightness[luv[..., 0]] + chromaticity[luv[..., 1], luv[..., 2]]
        return codes_of_image

    return _colour_table(codes)


def _code_parts(binning: Binning, uv_range: UvRange) -> tuple[Codes, Codes]:
    """Return the part of a code for each L* byte (256,), and for each u* and v* byte (256, 256)."""
    byte = np.arange(256)
    lightness = byte * LIGHTNESS_BINS // 256 * _CHROMATICITIES
    if uv_range == "full":
        u_bin = v_bin = byte * CHROMATICITY_BINS // 256
    else:
        u_bin, v_bin = (
            _bins(*limits, *of_byte)
            for limits, of_byte in zip(_RANGES[uv_range], _BYTE_RANGES, strict=True)
        )
    chromaticity = u_bin[:, np.newaxis] * CHROMATICITY_BINS + v_bin
    if binning == "perez":
        u, v = (low + byte * (high - low) / 255 for low, high in _BYTE_RANGES)
        chromaticity[np.hypot(u[:, np.newaxis], v) < _GREY_CHROMA] = _GREY
    return lightness.astype(np.uint16), chromaticity.astype(np.uint16)


def _bins(low: int, high: int, byte_low: int, byte_high: int) -> NDArray[np.int64]:
    """Return the bin of every byte, by integer arithmetic without rounding."""
    above = np.arange(256) * (byte_high - byte_low) + 255 * (byte_low - low)  # 255 (value - low)
    return np.clip(above * CHROMATICITY_BINS // (255 * (high - low)), 0, CHROMATICITY_BINS - 1)
