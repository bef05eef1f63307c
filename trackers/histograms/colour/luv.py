"""Bins of CIE L*u*v* colour, from the bytes of OpenCV's 8-bit conversion.

A pixel's colour becomes a code, its lightness bin and its chromaticity bin in one number, by
a table over all colours. The table asks OpenCV once for every colour there is; so the bins
are those of `cv2.cvtColor` to the bit, for a window of an image as for the whole.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackers.base.interface import Image
from trackers.histograms.colour.lookup import ColourTable, colour_table, looked_up

__all__ = ["CHROMATICITY_BINS", "LIGHTNESS_BINS", "N_BINS", "Binning", "LuvBins", "UvRange"]

Binning: TypeAlias = Literal["both", "perez"]
UvRange: TypeAlias = Literal["full", "natural", "srgb-gamut"]

LIGHTNESS_BINS = 10
CHROMATICITY_BINS = 10  # for u* and for v*
N_BINS = CHROMATICITY_BINS**2 + LIGHTNESS_BINS

# OpenCV's bytes span these: u* = byte · 354 / 255 - 134, v* = byte · 262 / 255 - 140.
_BYTE_RANGES = ((-134, 220), (-140, 122))
_RANGES: dict[UvRange, tuple[tuple[int, int], tuple[int, int]]] = {
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}
_GREY_CHROMA = 17.9  # a tenth of the largest √(u*² + v*²) of sRGB, that of red
_GREY = CHROMATICITY_BINS**2  # stands in a code where the chromaticity bin would
_CHROMATICITIES = _GREY + 1


@dataclass(frozen=True)
class LuvBins:
    """A way to bin colours; equal ones can share their work on a frame.

    Bins 0 to 99 are u* · 10 + v*, bins 100 to 109 are L*.

    Attributes
    ----------
    binning : {'both', 'perez'}
        'both': a pixel votes in its chromaticity bin and in its lightness bin. 'perez': in
        its chromaticity bin alone, or in its lightness bin alone if it has hardly any
        colour, √(u*² + v*²) < 17.9 (the structure of Pérez et al. 2002, carried over to
        L*u*v*).
    uv_range : {'full', 'natural', 'srgb-gamut'}
        What the 10 x 10 chromaticity bins divide; colours outside fall into the outermost
        bins. 'full': what a byte can hold, u* -134 to 220, v* -140 to 122. 'natural': -60 to
        120 and -80 to 80. 'srgb-gamut': -83 to 175 and -134 to 107.
    """

    binning: Binning = "both"
    uv_range: UvRange = "full"

    def codes(self, image: Image) -> NDArray[np.uint16]:
        """Codes of an image or of a window of one, shape (height, width)."""
        return looked_up(image, _table(self.binning, self.uv_range))

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
def _table(binning: Binning, uv_range: UvRange) -> ColourTable:
    """Code of every colour; a tenth of a second or two to make."""
    lightness, chromaticity = _code_parts(binning, uv_range)

    def codes(image: Image) -> NDArray[np.uint16]:
        luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
        found: NDArray[np.uint16] = lightness[luv[..., 0]] + chromaticity[luv[..., 1], luv[..., 2]]
        return found

    return colour_table(codes)


def _code_parts(
    binning: Binning, uv_range: UvRange
) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
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
