"""The attributes: a function each, found by its name.

A function is shown a frame in which the target is (`View`) and gives a number; NaN where there is
none to give. In frames without target, or where its box has no size, every attribute is NaN.

Each says how a sequence's value comes from those of its frames. What lasts is averaged (`mean`).
What harms by happening once counts by how far it goes: the value that 95 % of the frames stay
below (`95 %`), or above where less is harder (`5 %`); the very extreme may be a slip of the truth.

Boxes alone are used, of polygons and masks those around them: a mask, which few data have, would
make their values others than those of the rest.

Sources: [OTB] Wu, Lim and Yang, CVPR 2013; [VOT] Kristan et al., PAMI 2016, and its toolkit's
`sequence/clustering`; [VideoCube] Hu, Zhao, Huang and Huang, PAMI 2022; [Crete] Crete, Dolmiere,
Ladret and Nicolas, SPIE 6492, 2007.
"""

from math import hypot, inf, log2, nan, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.attributes.attribute import attribute
from trackmark.datasets.attributes.view import View, part_of

LOW_PASS = 9  # pixels over which [Crete] averages
ENLARGED = 1.5  # sides of the surround, in sides of the box, as [VOT] has it
ONE_LEVEL = 1e-4  # what rounding leaves of one grey level: resizing is by float32
BITS = 3  # of a colour channel that count in a histogram: 8 bins a channel, 512 in all


@attribute(unit="px", over="mean", least=0.0)
def size(now: View) -> float:
    """Root of the box's area, √(w h).

    [VideoCube] calls it scale; [OTB]'s low resolution is one below 20.
    """
    return now.side


@attribute(unit="octaves", over="95 %", least=0.0)
def scale_change(now: View) -> float:
    """Size against that in the first frame, |log₂(s / s₁)|: 1 is twice or half as large.

    [OTB]'s scale variation is one above 1.
    """
    return abs(log2(now.side / now.first.side)) if now.first else 0.0


@attribute(unit="octaves", over="95 %", least=0.0)
def aspect_change(now: View) -> float:
    """Width over height, against that in the first frame, |log₂((w / h) / (w₁ / h₁))|.

    As [VOT] has it, but for the base of the logarithm.
    """
    if now.first is None:
        return 0.0
    ratios = now.box[2:] / now.first.box[2:]
    return abs(log2(float(ratios[0] / ratios[1])))


@attribute(unit="sizes a frame", over="95 %", least=0.0)
def motion(now: View) -> float:
    """Way of the box's centre since the frame before, over its size there, |c - c'| / √(w' h').

    NaN where the target was not in that frame. A moving camera moves it, too.
    """
    if now.before is None:
        return nan
    way = now.centre - now.before.centre
    return hypot(*way.tolist()) / now.before.side


@attribute(unit="", over="mean", least=0.0, most=1.0)
def blur(now: View) -> float:
    """How much of the differences between neighbours is left when pixels are averaged [Crete].

    In the box's grey pixels, along rows: of the differences D (Sobel's), and D' of those after a
    mean over 9, Σ min(D, D') / ΣD; and along columns; the larger. From 0, all of it was fine
    detail, to 1, none was, whatever gain and offset the light has. Two pixels at the rim are left
    out, as scikit-image's `blur_effect` does. NaN where nothing differs.
    """
    found = []
    for along, window in (((1, 0), (LOW_PASS, 1)), ((0, 1), (1, LOW_PASS))):
        if min(now.grey.shape) < 4:
            continue
        averaged = cv2.blur(now.grey, window, borderType=cv2.BORDER_REFLECT)
        own, left = (
            np.abs(cv2.Sobel(picture, cv2.CV_64F, *along)[2:-1, 2:-1])
            for picture in (now.grey, averaged)
        )
        if own.any():
            found.append(float(np.minimum(own, left).sum() / own.sum()))
    return max(found, default=nan)


@attribute(unit="grey levels", over="95 %", least=0.0, most=255.0)
def brightness_change(now: View) -> float:
    """Mean grey level in the box, against that in the first frame, |m - m₁|.

    [VOT]'s illumination change. NaN where the box is out of either image.
    """
    first = now.first or now
    if now.grey.size == 0 or first.grey.size == 0:
        return nan
    return abs(float(now.grey.mean() - first.grey.mean()))


@attribute(unit="", over="5 %", least=-1.0, most=1.0)
def correlation(now: View) -> float:
    """Pearson's correlation of the box's grey pixels with those of the frame before, -1 to 1.

    Of the box's part that is in both images, the earlier one resized to the later (bilinear) where
    sizes differ. Less is harder. [VideoCube] takes whole frames, in which the target may be
    nothing. NaN where the target was not in that frame, and where either has one grey level.
    """
    if now.before is None:
        return nan
    either = np.stack([now.seen, now.before.seen])
    low, high = either[:, :2].max(axis=0), either[:, 2:].min(axis=0)
    pictures = [view.grey_in(_part(view.box, low, high)) for view in (now, now.before)]
    if any(picture.size == 0 for picture in pictures):
        return nan
    later, earlier = pictures
    resized = cv2.resize(earlier, later.shape[::-1], interpolation=cv2.INTER_LINEAR)
    off, earlier_off = later - later.mean(), resized - resized.mean()
    if min(np.ptp(later), np.ptp(resized)) < ONE_LEVEL:
        return nan
    spread = sqrt(float((off**2).sum() * (earlier_off**2).sum()))
    return float(np.clip((off * earlier_off).sum() / spread, -1.0, 1.0))


@attribute(unit="", over="mean", least=0.0, most=1.0)
def clutter(now: View) -> float:
    """Likeness of target and surround: Bhattacharyya's coefficient of their colours, Σ √(p q).

    p and q are shares of 8 x 8 x 8 bins of BGR, of the pixels in the box and of those around it,
    in a box 1.5 times as wide and as high ([VOT]'s clutter). 1 where both have the same colours,
    so that a histogram tells nothing; 0 where they share none. NaN where either has no pixel.
    """
    grown = now.box[2:] * ENLARGED
    around = np.concatenate([now.centre - grown / 2, grown])
    target, both = (_histogram(part_of(now.image, box)) for box in (now.box, around))
    surround = both - target
    if not (target.any() and surround.any()):
        return nan
    shared = np.sqrt((target / target.sum()) * (surround / surround.sum())).sum()
    return min(float(shared), 1.0)


@attribute(unit="share", over="mean", least=0.0, most=1.0)
def visibility(now: View) -> float:
    """Share of the target that is seen, as the truth says it; NaN where it says nothing."""
    return now.visibility


@attribute(unit="sizes", over="5 %", least=-inf)
def border(now: View) -> float:
    """Room between the box and the image's nearest border, over the target's size.

    min(x, y, W - x - w, H - y - h) / √(w h): 0 where it touches the border (data that cut their
    boxes off there go no further), below where a part is beyond ([OTB]'s out of view).
    """
    height, width = now.image.shape[:2]
    end = now.box[:2] + now.box[2:]
    room = np.concatenate([now.box[:2], np.array([width, height]) - end])
    return float(room.min()) / now.side


def _part(
    box: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A part of a box, from these shares of its sides to those, (2,) each."""
    return np.concatenate([box[:2] + low * box[2:], (high - low) * box[2:]])


def _histogram(part: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Pixels by bin of colour, shape (512,)."""
    bins = (part >> (8 - BITS)).reshape(-1, 3).astype(np.intp)
    return np.bincount(bins @ np.array([1 << 2 * BITS, 1 << BITS, 1]), minlength=1 << 3 * BITS)
