"""Counts of colour bins in many regions of a frame, by the fastest method.

Rectangles are counted directly or by an integral histogram, ellipses directly. Both methods return
the same integers. The choice depends on estimated times per pixel.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Codes, Ints
from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import N_BINS, JointBins, LuvBins
from trackmark.trackers.histograms.ellipses import EllipseCounts, Kernel, ellipse_counts
from trackmark.trackers.histograms.rectangles import (
    IntegralHistogram,
    Regions,
    direct_counts,
    integral_counts,
    integral_histogram,
)

Counts: TypeAlias = NDArray[np.int32]

# Nanoseconds, measured on one machine; only ratios matter.
_CODE = 1.5  # code of a pixel
_INTEGRAL = 0.1  # pixel and bin of an integral histogram
_DIRECT = 0.5  # pixel of a region, counted directly
_DIRECT_REGION = 3000.0  # overhead of a region's histogram

_BINS_OF_A_FRAME = 40  # typical number of bins that occur in a frame


def count_regions(frame: SharedFrame, regions: Regions, colours: LuvBins, bins: Ints) -> Counts:
    """Return votes for m bins in regions, int32 (parts, n, m).

    If many trackers share the frame, they share one integral histogram.
    """
    window = (regions.right - regions.left) * (regions.bottom - regions.top)
    direct = _DIRECT * float(regions.pixels.sum()) + _DIRECT_REGION * regions.pixels.size
    integral = _INTEGRAL * len(bins) * window
    alone = _CODE * window + min(direct, integral)
    height, width = frame.image.shape[:2]
    left, top = regions.left, regions.top
    flat = regions.bounds.reshape(-1, 4)
    shared = (_CODE + _INTEGRAL * _BINS_OF_A_FRAME) * height * width / frame.sharers
    if shared < alone:
        counts = integral_counts(*frame.compute(_integral_histogram, colours), flat, bins)
    else:
        codes = colours.codes(frame.image[top : regions.bottom, left : regions.right])
        flat = np.maximum(flat - np.array([left, top, left, top]), 0)  # empty regions stay 0
        if integral < direct:
            histogram = integral_histogram(codes, colours.votes, bins, N_BINS)
            counts = integral_counts(*histogram, flat, bins)
        else:
            counts = direct_counts(codes, colours.votes, flat, bins, N_BINS)
    return counts.reshape(*regions.pixels.shape, -1)


def count_ellipses(
    frame: SharedFrame, ellipses: Array, kernel: Kernel, colours: JointBins, bins: Ints
) -> EllipseCounts:
    """Count bins as `ellipse_counts` does; if many trackers share a frame, they share its codes."""
    height, width = frame.image.shape[:2]
    limits = np.array([width, height])
    centres, half_axes = ellipses[:, :2], ellipses[:, 2:]
    left, top = np.clip((centres - half_axes).min(axis=0), 0, limits).astype(int).tolist()
    right, bottom = np.clip((centres + half_axes).max(axis=0) + 1, 0, limits).astype(int).tolist()
    high = bool(half_axes[0, 1] > half_axes[0, 0])
    if width * height < frame.sharers * (right - left) * (bottom - top):
        all_codes = frame_codes(frame, colours, high)
        codes = all_codes[left:right, top:bottom] if high else all_codes[top:bottom, left:right]
    else:
        codes = colours.codes(frame.image[top:bottom, left:right], high)
    return ellipse_counts(codes, (left, top), high, ellipses, kernel, bins, colours.n_bins)


def frame_codes(frame: SharedFrame, colours: JointBins, transposed: bool) -> Codes:
    """Return the codes of a frame, computed once for all its trackers; see `JointBins.codes`."""
    return frame.compute(_codes, colours, transposed)


def _codes(image: Image, colours: JointBins, transposed: bool) -> Codes:
    return colours.codes(image, transposed)


def _integral_histogram(image: Image, colours: LuvBins) -> IntegralHistogram:
    """Return the integral histogram of a frame, restricted to the bins that occur."""
    codes = colours.codes(image)
    whole = np.array([[0, 0, image.shape[1], image.shape[0]]])
    every = np.arange(N_BINS)
    present_bins = np.flatnonzero(direct_counts(codes, colours.votes, whole, every, N_BINS)[0])
    return integral_histogram(codes, colours.votes, present_bins, N_BINS)
