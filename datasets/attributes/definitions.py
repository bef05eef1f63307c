"""Definitions of the attributes, one function each.

A function returns a number for the target in a frame (`TargetView`), or NaN if it is undefined. In
frames without target, or with a box without size, all attributes are NaN.

The decorator states how the values of the frames are combined to the value of the sequence. Lasting
properties are averaged (`mean`). Properties that can end tracking in a single frame use a quantile:
95 % of the frames are below it (`95 %`), or above it if low values are difficult (`5 %`). A maximum
would depend on single errors of the ground truth.

Boxes are used even if the ground truth contains polygons or masks. Few datasets have masks, and
values from masks would not be comparable with values from boxes.

Sources: [OTB] Wu, Lim and Yang, CVPR 2013; [VOT] Kristan et al., PAMI 2016, and its toolkit's
`sequence/clustering`; [VideoCube] Hu, Zhao, Huang and Huang, PAMI 2022; [Crete] Crete, Dolmiere,
Ladret and Nicolas, SPIE 6492, 2007.
"""

from math import hypot, inf, log2, nan, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.attributes.attribute import attribute
from trackmark.datasets.attributes.view import TargetView, part_of

BLUR_PIXELS = 9  # width of the mean filter in [Crete]
SURROUND_SCALE = 1.5  # size of the box around the surroundings, relative to the box [VOT]
MIN_LEVELS = 1e-4  # a smaller range of grey levels can be a rounding error of resizing
N_BITS = 3  # bits of a colour channel in histograms: 8 bins per channel, 512 in total


@attribute(unit="px", statistic="mean", minimum=0.0)
def size(view: TargetView) -> float:
    """Root of the box's area, √(w h).

    [VideoCube] calls it scale; low resolution in [OTB] is a size below 20.
    """
    return view.side


@attribute(unit="octaves", statistic="95 %", minimum=0.0)
def scale_change(view: TargetView) -> float:
    """Size relative to the first frame, |log₂(s / s₁)|: 1 is twice or half as large.

    Scale variation in [OTB] is a change above 1.
    """
    return abs(log2(view.side / view.first.side)) if view.first else 0.0


@attribute(unit="octaves", statistic="95 %", minimum=0.0)
def aspect_change(view: TargetView) -> float:
    """Aspect ratio relative to the first frame, |log₂((w / h) / (w₁ / h₁))|.

    [VOT] defines it with another base of the logarithm.
    """
    if view.first is None:
        return 0.0
    ratios = view.box[2:] / view.first.box[2:]
    return abs(log2(float(ratios[0] / ratios[1])))


@attribute(unit="sizes/frame", statistic="95 %", minimum=0.0)
def motion(view: TargetView) -> float:
    """Displacement of the box's centre since the previous frame, in sizes, |c - c'| / √(w' h').

    NaN if the target is absent in the previous frame. Camera motion is included.
    """
    if view.previous is None:
        return nan
    displacement = view.centre - view.previous.centre
    return hypot(*displacement.tolist()) / view.previous.side


@attribute(unit="", statistic="mean", minimum=0.0, maximum=1.0)
def blur(view: TargetView) -> float:
    """Fraction of the differences between adjacent pixels that remains after averaging [Crete].

    For the grey pixels in the box: Σ min(D, D') / ΣD, with Sobel differences D of the image and D'
    of its mean over 9 pixels. The fraction is computed along rows and along columns, and the larger
    one is returned: from 0 (only fine detail) to 1 (no fine detail), independent of gain and
    offset. As in `blur_effect` of scikit-image, pixels at the border of the box are left out. NaN
    for a uniform box.
    """
    shares = []
    for along, window in (((1, 0), (BLUR_PIXELS, 1)), ((0, 1), (1, BLUR_PIXELS))):
        if min(view.grey.shape) < 4:
            continue
        averaged = cv2.blur(view.grey, window, borderType=cv2.BORDER_REFLECT)
        before, after = (
            np.abs(cv2.Sobel(image, cv2.CV_64F, *along)[2:-1, 2:-1])
            for image in (view.grey, averaged)
        )
        if before.any():
            shares.append(float(np.minimum(before, after).sum() / before.sum()))
    return max(shares, default=nan)


@attribute(unit="grey levels", statistic="95 %", minimum=0.0, maximum=255.0)
def brightness_change(view: TargetView) -> float:
    """Difference of the mean grey level in the box from that in the first frame, |m - m₁|.

    Illumination change in [VOT]. NaN if the box is outside one of the images.
    """
    first = view.first or view
    if view.grey.size == 0 or first.grey.size == 0:
        return nan
    return abs(float(view.grey.mean() - first.grey.mean()))


@attribute(unit="", statistic="5 %", minimum=-1.0, maximum=1.0)
def correlation(view: TargetView) -> float:
    """Pearson correlation of the box's grey pixels with those of the previous frame, -1 to 1.

    Only the part of the box that is inside both images is compared. The pixels of the previous
    frame are resized to the current size by bilinear interpolation. Low values are difficult.
    [VideoCube] instead correlates whole frames, which the target may hardly affect. NaN if the
    target is absent in the previous frame, or if the pixels of a frame are uniform.
    """
    if view.previous is None:
        return nan
    visible = np.stack([view.visible_part, view.previous.visible_part])
    low, high = visible[:, :2].max(axis=0), visible[:, 2:].min(axis=0)
    patches = [each.grey_in(_inner_box(each.box, low, high)) for each in (view, view.previous)]
    if any(patch.size == 0 for patch in patches):
        return nan
    current, previous = patches
    resized = cv2.resize(previous, current.shape[::-1], interpolation=cv2.INTER_LINEAR)
    a, b = current - current.mean(), resized - resized.mean()
    if min(np.ptp(current), np.ptp(resized)) < MIN_LEVELS:
        return nan
    scale = sqrt(float((a**2).sum() * (b**2).sum()))
    return float(np.clip((a * b).sum() / scale, -1.0, 1.0))


@attribute(unit="", statistic="mean", minimum=0.0, maximum=1.0)
def clutter(view: TargetView) -> float:
    """Similarity of target and surroundings: Bhattacharyya coefficient of their colours, Σ √(p q).

    p and q are normalised BGR histograms with 8 x 8 x 8 bins. p contains the pixels in the box. q
    contains the pixels around it, inside a box 1.5 times as wide and as high (clutter in [VOT]).
    1 means equal colours, 0 no common colour. NaN if p or q has no pixels.
    """
    size = view.box[2:] * SURROUND_SCALE
    outer_box = np.concatenate([view.centre - size / 2, size])
    target, target_and_surround = (
        _histogram(part_of(view.image, box)) for box in (view.box, outer_box)
    )
    surround = target_and_surround - target
    if not (target.any() and surround.any()):
        return nan
    shared = np.sqrt((target / target.sum()) * (surround / surround.sum())).sum()
    return min(float(shared), 1.0)


@attribute(unit="share", statistic="mean", minimum=0.0, maximum=1.0)
def visibility(view: TargetView) -> float:
    """Visible fraction of the target in the ground truth; NaN if unknown."""
    return view.visibility


@attribute(unit="sizes", statistic="5 %", minimum=-inf)
def border(view: TargetView) -> float:
    """Distance of the box to the nearest image border, in sizes of the target.

    min(x, y, W - x - w, H - y - h) / √(w h) for images of W x H pixels. It is 0 if the box touches
    the border, and negative if a part of the box is outside (out of view in [OTB]). If a dataset
    clips its boxes at the border, values are never negative.
    """
    height, width = view.image.shape[:2]
    end = view.box[:2] + view.box[2:]
    distances = np.concatenate([view.box[:2], np.array([width, height]) - end])
    return float(distances.min()) / view.side


def _inner_box(
    box: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the part of a box between the relative corners `low` and `high`, shape (2,) each."""
    return np.concatenate([box[:2] + low * box[2:], (high - low) * box[2:]])


def _histogram(pixels: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Return the number of pixels by colour bin, shape (512,)."""
    bins = (pixels >> (8 - N_BITS)).reshape(-1, 3).astype(np.intp)
    return np.bincount(
        bins @ np.array([1 << 2 * N_BITS, 1 << N_BITS, 1]), minlength=1 << 3 * N_BITS
    )
