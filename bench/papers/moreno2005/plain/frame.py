"""A frame: its colours in cells, the window W in it, and means in and out of it (section 5.2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion

from bench.papers.moreno2005.plain.contours import area

__all__ = ["Frame", "drawn_colours", "sure"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

NARROWEST = 8  # pixels of the image that a window keeps
LEAST_PRIOR = 0.05  # of target and background, by areas


class Frame:
    """What is seen of a frame around the last contour.

    Attributes
    ----------
    colours : ndarray of float64, shape (K, 3)
        RGB in [0, 1], of each of the cells of colour space that the image occupies.
    cells : ndarray of intp, shape (rows, columns)
        Cell of each pixel.
    box : tuple of int
        First column and row of W, and those after the last.
    window, around : ndarray of bool, shape (rows, columns)
        W, and what it is compared with.
    prior : float
        P(O).
    """

    def __init__(self, image: Image, contour: Array, settings: Any) -> None:
        rgb = image[..., ::-1].reshape(-1, 3)
        levels = rgb.astype(int) * settings.colour_levels // 256
        _, cells = np.unique(levels @ [64**2, 64, 1], return_inverse=True)
        sums = [np.bincount(cells, rgb[:, channel]) for channel in range(3)]
        self.colours = np.stack(sums, axis=1) / np.bincount(cells)[:, np.newaxis] / 255
        height, width = image.shape[:2]
        self.cells = cells.reshape(height, width)

        margin = settings.window_margin * width / 320
        least, most = contour.min(axis=0), contour.max(axis=0)
        more = margin + settings.window_growth * (most - least) / 2
        x0, x1 = _interval(least[0] - more[0], most[0] + more[0], width)
        y0, y1 = _interval(least[1] - more[1], most[1] + more[1], height)
        self.box = x0, y0, x1, y1
        self.window = np.zeros((height, width), bool)
        self.window[y0:y1, x0:x1] = True
        self.around = ~self.window
        if settings.ring != "image":
            middle, half = np.array([x0 + x1, y0 + y1]) / 2, np.array([x1 - x0, y1 - y0]) / 2
            left, top = middle - settings.ring * half
            right, bottom = middle + settings.ring * half
            within = np.zeros((height, width), bool)
            rows, columns = _interval(top, bottom, height), _interval(left, right, width)
            within[slice(*rows), slice(*columns)] = True
            self.around &= within
        self.prior = settings.object_prior
        if self.prior == "area":
            share = area(contour) / self.window.sum()
            self.prior = min(max(share, LEAST_PRIOR), 1 - LEAST_PRIOR)

    def difference(self, posteriors: Array) -> float:
        """Mean in W less mean around it, of posteriors of the cells."""
        pixels = posteriors[self.cells]
        outside = pixels[self.around].mean() if self.around.any() else 0.0
        return float(pixels[self.window].mean() - outside)


def _interval(start: float, end: float, limit: int) -> tuple[int, int]:
    """Pixels from start to end that are in the image."""
    narrowest = min(NARROWEST, limit)
    first = min(max(int(np.floor(start)), 0), limit - narrowest)
    return first, min(max(int(np.ceil(end)), first + narrowest), limit)


def drawn_colours(image: Image, region: Mask, count: int, random: np.random.Generator) -> Array:
    """RGB in [0, 1] of pixels of a region, drawn with replacement."""
    rows, columns = np.nonzero(region)
    chosen = random.integers(0, len(rows), count)
    return image[rows[chosen], columns[chosen], ::-1] / 255


def sure(mask: Mask) -> tuple[Mask, Mask]:
    """Target and background without the pixels next to their border, on either side."""
    target = binary_erosion(mask, np.ones((3, 3)))
    background = ~binary_dilation(mask, np.ones((5, 5)))
    return target if target.any() else mask, background
