"""Bins of colours: joint ones of three channels (RGB or HSV), and those of CIE L*u*v*.

HSV and L*u*v* are those of OpenCV's 8-bit conversion: a table asks it once for every colour there
is, so that the bins are those of `cv2.cvtColor` to the bit, for a window of an image as for the
whole.
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

# OpenCV's bytes span these: u* = byte · 354 / 255 - 134, v* = byte · 262 / 255 - 140.
_BYTE_RANGES = ((-134, 220), (-140, 122))
_RANGES: dict[UvRange, tuple[tuple[int, int], tuple[int, int]]] = {
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}
_GREY_CHROMA = 17.9  # a tenth of the largest √(u*² + v*²) of sRGB, that of red
_GREY = CHROMATICITY_BINS**2  # stands in a code where the chromaticity bin would
_CHROMATICITIES = _GREY + 1

_BITS = np.arange(8)
_SPREAD = ((np.arange(256)[:, np.newaxis] >> _BITS & 1) << 3 * _BITS).sum(axis=1).astype(np.uint32)
"""Each byte with its bits three places apart."""


def _colour_table(codes: Callable[[Image], Codes]) -> Codes:
    """Return the code of every 8-bit colour, shape (2²⁴,), 32 MiB, by `_SPREAD` of its channels."""
    plane = np.empty((256, 256, 3), np.uint8)
    plane[..., 1] = np.arange(256)[:, np.newaxis]
    plane[..., 2] = np.arange(256)
    places = _SPREAD[:, np.newaxis] << 1 | _SPREAD
    table = np.empty(256**3, np.uint16)
    for blue in range(256):
        plane[..., 0] = blue
        table[_SPREAD[blue] << 2 | places] = codes(plane)
    return table


@njit(cache=True)
def _looked_up(image: Image, table: Codes) -> Codes:
    height, width, _ = image.shape
    found = np.empty((height, width), np.uint16)
    for row in range(height):
        for column in range(width):
            # Indices that can't be negative need no check for it.
            blue = _SPREAD[np.uintp(image[row, column, 0])]
            green = _SPREAD[np.uintp(image[row, column, 1])]
            red = _SPREAD[np.uintp(image[row, column, 2])]
            found[row, column] = table[np.uintp(blue << 2 | green << 1 | red)]
    return found


@dataclass(frozen=True)
class JointBins:
    """Joint bins of three channels; equal ones can share their work on a frame.

    With 'rgb' R, G and B are each divided evenly into `bins`, 2 to 32; with 'hsv' H and S so, and V
    into half as many.
    """

    space: ColourSpace = "rgb"
    bins: int = 8

    @property
    def n_bins(self) -> int:
        """Number of bins that there are."""
        return self.bins**3 if self.space == "rgb" else self.bins**2 * (self.bins // 2)

    def codes(self, image: Image, transposed: bool = False) -> Codes:
        """Return each pixel's bin, (height, width) or transposed: long runs in high regions."""
        if self.space == "rgb":
            codes = _rgb_codes(image, _divided(self.bins), self.bins)
        else:
            codes = _looked_up(image, _hsv_table(self.bins))
        return np.ascontiguousarray(codes.T) if transposed else codes


@lru_cache
def _divided(bins: int) -> Codes:
    """Bin of every byte."""
    return (np.arange(256) * bins // 256).astype(np.uint16)


@njit(cache=True)
def _rgb_codes(image: Image, of_byte: Codes, bins: int) -> Codes:
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
def _hsv_table(bins: int) -> Codes:
    def codes(image: Image) -> Codes:
        hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 2, 0)
        half = bins // 2
        found: Codes = hue.astype(np.uint16) * bins // 180 * (bins * half)
        found += saturation.astype(np.uint16) * bins // 256 * half
        found += value.astype(np.uint16) * half // 256
        return found

    return _colour_table(codes)


@dataclass(frozen=True)
class LuvBins:
    """Bins of CIE L*u*v*; equal ones can share their work on a frame.

    A pixel's colour becomes a code, its lightness bin and its chromaticity bin in one number. Bins
    0 to 99 are u* · 10 + v*, bins 100 to 109 are L*. Of `both` a pixel votes in each; of `perez` in
    its chromaticity bin alone, or in its lightness bin alone if it has hardly any colour, √(u*² +
    v*²) < 17.9 (the structure of Pérez et al. 2002, carried over to L*u*v*).

    The 10 x 10 chromaticity bins divide what a byte can hold (`full`, u* -134 to 220, v* -140 to
    122), -60 to 120 and -80 to 80 (`natural`), or -83 to 175 and -134 to 107 (`srgb-gamut`);
    colours outside fall into the outermost bins.
    """

    binning: Binning = "both"
    uv_range: UvRange = "full"

    def codes(self, image: Image) -> Codes:
        """Codes of an image or of a window of one, shape (height, width)."""
        return _looked_up(image, _luv_table(self.binning, self.uv_range))

    @property
    def votes(self) -> NDArray[np.uint8]:
        """Bins that a code votes in, shape (codes, votes a pixel)."""
        return _votes(self.binning)

    @property
    def votes_a_pixel(self) -> int:
        """Over how many bins a pixel counts, in all."""
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
        found: Codes = lightness[luv[..., 0]] + chromaticity[luv[..., 1], luv[..., 2]]
        return found

    return _colour_table(codes)


def _code_parts(binning: Binning, uv_range: UvRange) -> tuple[Codes, Codes]:
    """What the byte of L* adds to a code, and what those of u* and v* do."""
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
    """Bin of every byte, in integers so that no rounding moves an edge."""
    above = np.arange(256) * (byte_high - byte_low) + 255 * (byte_low - low)  # 255 (value - low)
    return np.clip(above * CHROMATICITY_BINS // (255 * (high - low)), 0, CHROMATICITY_BINS - 1)
