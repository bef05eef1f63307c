"""Frame differencing: motion between three frames (Wang & Tang 2010, section 2.1.2).

The camera must not move. Otherwise, edges differ in the whole image and raise the adaptive
threshold. `FrameMotion.changing` then shows an unusually large share of changing pixels.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image

MAX_WINDOW = 9  # largest side [pixels] for which sums of differences, each ≤ 3 · 255, fit 16 bits
MIN_CHANGE = 8  # mean change of a window above sensor noise [grey levels per pixel]

Sums = NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """Differences between a frame and the two frames before it; maps (height, width).

    D¹ is the absolute grey difference between the previous frame and this one, summed over the
    window around each pixel; D² is the same for the previous pair of frames. S = D¹ + D² is twice
    the D in step 3 of the paper. Trackers that share frames share this object: do not modify its
    arrays. Objects are compared by identity, because `SharedFrame` uses them in keys.
    """

    grey: Sums  # R + G + B of the frame
    latest: Sums  # D¹; empty in the first frame
    earlier: Sums  # D²
    mean: float  # of S over the image
    deviation: float  # population standard deviation of S
    changing: float  # share of pixels whose window changes by `MIN_CHANGE` or more


def first_frame(image: Image) -> FrameMotion:
    """Return the grey values of the first frame, without motion."""
    grey = np.empty(image.shape[:2], np.uint16)
    _sum_channels(image, grey)
    none = np.empty((0, 0), np.uint16)
    return FrameMotion(grey, none, none, 0.0, 0.0, 0.0)


def compare_frames(image: Image, previous: FrameMotion, window: int, averaged: bool) -> FrameMotion:
    """Return the differences between a frame and the previous one, of equal size.

    `window`: odd side of the squares over which differences are summed, at most `MAX_WINDOW`, equal
    in all frames [pixels]. Pixels outside the image count as unchanged. If `averaged`, D is the
    mean of D¹ and D², otherwise D¹. The second frame has no D².
    """
    # One allocation: the allocator would return two smaller ones to the system at every frame.
    grey, latest = np.empty((2, *image.shape[:2]), np.uint16)
    _sum_channels(image, grey)
    averaged = averaged and previous.latest.shape == grey.shape
    earlier = previous.latest if averaged else latest
    noticeable = 2 * 3 * MIN_CHANGE * window * window
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
    """Return the share of a window's pixels in the image with D¹ + D² above a threshold.

    `right` and `bottom` are exclusive. The share is 0 for a window outside the image.
    """
    rows, columns = latest.shape
    left, top, right, bottom = max(left, 0), max(top, 0), min(right, columns), min(bottom, rows)
    if right <= left or bottom <= top:
        return 0.0
    limit = np.int32(np.floor(threshold))  # equivalent, because the compared sums are integers
    moving = 0
    for row in range(top, bottom):
        first, second = latest[row, left:right], earlier[row, left:right]
        of_row = np.int32(0)  # same width as the compared values, so that the loop is vectorised
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
    """Fill `latest`; return Σ S, Σ S² and the number of pixels with S ≥ `noticeable`."""
    rows, columns = grey.shape
    half = window // 2
    recent = np.zeros((window, columns), np.uint16)
    sums = np.zeros(columns + 2 * half, np.uint16)  # padded by unchanged columns on both sides
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
