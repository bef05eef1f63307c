"""Improved frame differencing: what has moved between three frames (Wang & Tang 2010, 2.1.2).

The camera must stand still. Where it moves, edges differ all over the image, and the adaptive
threshold rises with them: `FrameMotion.changing` tells.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image

LARGEST_WINDOW = 9  # pixels a side whose sum of differences, 3 · 255 each, fits 16 bits
NOTICEABLE = 8  # grey levels a pixel, on the mean of a window: what sensors' noise does not reach

Sums = NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """How much a frame differs from those before it; maps are of shape (height, width).

    D¹ and D² are absolute differences of grey, summed over the window around each pixel, from the
    frame before to this one, and from that before it. Their sum S is 2 D of step 3. Trackers that
    share a frame's work share these, one after the other; so it is equal to itself alone, and its
    arrays are not written to.
    """

    grey: Sums  # R + G + B of the frame
    latest: Sums  # D¹; empty in the first frame
    earlier: Sums  # D²
    mean: float  # of S over the image
    deviation: float  # standard deviation of S (of the population)
    changing: float  # share of the pixels whose window differs by `NOTICEABLE` or more


def first_frame(image: Image) -> FrameMotion:
    """What the first frame gives to the next: its grey. Nothing has moved yet."""
    grey = np.empty(image.shape[:2], np.uint16)
    _sum_channels(image, grey)
    none = np.empty((0, 0), np.uint16)
    return FrameMotion(grey, none, none, 0.0, 0.0, 0.0)


def frame_after(image: Image, previous: FrameMotion, window: int, averaged: bool) -> FrameMotion:
    """Local differences of a frame, which is as large as the one before.

    They are summed over squares of `window` pixels a side, odd, at most `LARGEST_WINDOW`, the same
    as before. What is outside the image counts as unchanged. D is the mean of D¹ and D² where it
    is averaged, otherwise D¹ alone; the second frame has no D².
    """
    # One piece of memory: two would be given back to the system and faulted in at every frame.
    grey, latest = np.empty((2, *image.shape[:2]), np.uint16)
    _sum_channels(image, grey)
    averaged = averaged and previous.latest.shape == grey.shape
    earlier = previous.latest if averaged else latest
    noticeable = 2 * 3 * NOTICEABLE * window * window
    total, squares, changing = _local_differences(
        grey, previous.grey, window, averaged, earlier, noticeable, latest
    )
    mean = total / grey.size
    variance = squares / grey.size - mean * mean
    return FrameMotion(grey, latest, earlier, mean, max(variance, 0.0) ** 0.5, changing / grey.size)


@njit(cache=True)
def moving_share(
    latest: Sums, earlier: Sums, threshold: float, left: int, top: int, right: int, bottom: int
) -> float:
    """Share of the pixels of a window inside the image with D¹ + D² above a threshold.

    0 for a window without a pixel in the image. Columns `left` to `right` and rows `top` to
    `bottom`, their ends excluded.
    """
    rows, columns = latest.shape
    left, top, right, bottom = max(left, 0), max(top, 0), min(right, columns), min(bottom, rows)
    if right <= left or bottom <= top:
        return 0.0
    limit = np.int32(np.floor(threshold))  # of whole numbers just those above it exceed it
    moving = 0
    for row in range(top, bottom):
        first, second = latest[row, left:right], earlier[row, left:right]
        of_row = np.int32(0)  # as wide as what is compared, for the loop to be vectorised
        for column in range(right - left):
            of_row += np.int32(np.int32(first[column]) + np.int32(second[column]) > limit)
        moving += int(of_row)
    return moving / ((right - left) * (bottom - top))


@njit(cache=True)
def _sum_channels(image: Image, grey: Sums) -> None:
    rows, columns, _ = image.shape
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            grey[row, column] = np.uint16(blue) + np.uint16(green) + np.uint16(red)


@njit(cache=True)
def _local_differences(
    grey: Sums,
    previous: Sums,
    window: int,
    averaged: bool,
    earlier: Sums,
    noticeable: int,
    latest: Sums,
) -> tuple[np.int64, np.int64, np.int64]:
    """Fill `latest`; return sums of S and S², and the pixels with S of at least `noticeable`."""
    rows, columns = grey.shape
    half = window // 2
    recent = np.zeros((window, columns), np.uint16)
    sums = np.zeros(columns + 2 * half, np.uint16)  # with unchanged columns on both sides
    total, squares, changing = np.int64(0), np.int64(0), np.int64(0)
    for row in range(rows + half):
        oldest = recent[row % window]
        for column in range(columns):
            sums[half + column] -= oldest[column]
        if row < rows:
            for column in range(columns):
                step = np.int32(grey[row, column]) - np.int32(previous[row, column])
                oldest[column] = np.uint16(abs(step))
                sums[half + column] += oldest[column]
        else:
            oldest[:] = 0
        if row < half:
            continue
        of_row = latest[row - half]
        for column in range(columns):
            of_row[column] = sums[column]
        for shift in range(1, window):
            for column in range(columns):
                of_row[column] += sums[column + shift]
        other = earlier[row - half] if averaged else of_row
        for column in range(columns):
            both = np.uint32(of_row[column]) + np.uint32(other[column])
            total += np.int64(both)
            squares += np.int64(np.uint64(both) * np.uint64(both))
            changing += np.int64(both >= noticeable)
    return total, squares, changing
