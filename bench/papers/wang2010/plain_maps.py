"""Maps of colour and motion in plain NumPy, and mean shift of a window on a map.

Images are BGR, uint8 of shape (rows, columns, 3). Boxes are `[x, y, width, height]` in pixels. Maps
are float64 of shape (rows, columns). The methods in `plain` use these functions.
"""

from math import floor, hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Image, Mask

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Limits = tuple[float, float, float]

NOTHING = 1e-9  # a window with a smaller sum does not move
ROUNDING = 1e-9  # tolerance of window edges at pixel borders [px]
EVERYTHING: Limits = (0.0, 0.0, 1.0)


def whole_size(size: float) -> int:
    """Round the side of a window to whole pixels, at least 1 [px]."""
    return max(1, floor(size + 0.5))


def window_slices(
    shape: tuple[int, ...], x: float, y: float, width: int, height: int
) -> tuple[slice, slice]:
    """Return the rows and columns of a window that lie inside an image of this shape."""
    left = floor(x - width / 2 + 0.5 + ROUNDING)
    top = floor(y - height / 2 + 0.5 + ROUNDING)
    rows, columns = shape[:2]
    return (
        slice(min(max(top, 0), rows), min(max(top + height, 0), rows)),
        slice(min(max(left, 0), columns), min(max(left + width, 0), columns)),
    )


def box_slices(shape: tuple[int, ...], box: Box) -> tuple[slice, slice]:
    """Return the rows and columns of the window of a box."""
    x, y, width, height = box.tolist()
    size = whole_size(width), whole_size(height)
    return window_slices(shape, x + width / 2, y + height / 2, *size)


def window_sum(values: Array, x: float, y: float, width: int, height: int) -> float:
    """Return M00 of the window around a centre (equation 6)."""
    return float(values[window_slices(values.shape, x, y, width, height)].sum())


def mean_shift(
    joint: Array,
    x: float,
    y: float,
    width: int,
    height: int,
    stop_distance: float = 2.0,
    max_iterations: int = 11,
) -> tuple[float, float, int, float]:
    """Move a window to the centroid of the map in it until a step is short (equations 6 and 7).

    `joint`: map. `x`, `y`: initial centre [px]. `width`, `height`: size of the window [px].
    `stop_distance`: ε, the shortest step before another one [px]. `max_iterations`: n0 + 1. Returns
    the final centre x and y, the number of computed centroids, and M00 of the final window. An
    empty window does not move.
    """
    for iteration in range(1, max_iterations + 1):
        rows, columns = window_slices(joint.shape, x, y, width, height)
        inside = joint[rows, columns]
        total = float(inside.sum())
        if total <= NOTHING:
            return x, y, iteration, total
        new_x = inside.sum(axis=0) @ np.arange(columns.start, columns.stop) / total + 0.5
        new_y = inside.sum(axis=1) @ np.arange(rows.start, rows.stop) / total + 0.5
        step = hypot(new_x - x, new_y - y)
        x, y = float(new_x), float(new_y)
        if step < stop_distance:
            break
    return x, y, iteration, window_sum(joint, x, y, width, height)


class Template(NamedTuple):
    """Histograms of the target in the first frame, divided by their largest bin.

    Pixels below the minimum saturation or value, or above the maximum value, are ignored; all
    limits are in [0, 1].
    """

    hue: Array
    saturation: Array
    limits: Limits = EVERYTHING


def colour_bins(image: Image, hue_bins: int = 32, saturation_bins: int = 32) -> tuple[Whole, Whole]:
    """Return the bins of hue and saturation of MATLAB's `rgb2hsv`, by integer arithmetic.

    Grey pixels have hue 0, black pixels saturation 0.
    """
    channels = _channels(image)
    return _hue_bins(channels, hue_bins), _saturation_bins(channels, saturation_bins)


def make_template(
    image: Image,
    box: Box,
    hue_bins: int = 32,
    saturation_bins: int = 32,
    limits: Limits = EVERYTHING,
) -> Template:
    """Return the histograms of the pixels of a rectangle within the limits of `Template`.

    Raises `ValueError` if no pixel is in the image and within the limits.
    """
    patch = image[box_slices(image.shape, box)]
    counted = _counted(patch, *limits)
    if not counted.any():
        raise ValueError(
            f"box {box.tolist()}: no pixel is in the image and within "
            f"the limits of saturation and value {limits}. Give another box."
        )
    hue, saturation = colour_bins(patch, hue_bins, saturation_bins)
    hues = np.bincount(hue[counted], minlength=hue_bins)
    saturations = np.bincount(saturation[counted], minlength=saturation_bins)
    return Template(hues / hues.max(), saturations / saturations.max(), limits)


def hue_map(image: Image, template: Template) -> Array:
    """Return I_h: the relative frequency of each pixel's hue in the template, in [0, 1]."""
    weights = template.hue[_hue_bins(_channels(image), len(template.hue))]
    return _without_uncounted(weights, image, template)


def colour_map(image: Image, template: Template, alpha: float = 0.7) -> Array:
    """Return I_c = α I_h + (1 - α) I_s, in [0, 1] (equation 3)."""
    hue, saturation = colour_bins(image, len(template.hue), len(template.saturation))
    weights = alpha * template.hue[hue] + (1 - alpha) * template.saturation[saturation]
    return _without_uncounted(weights, image, template)


def _without_uncounted(weights: Array, image: Image, template: Template) -> Array:
    if template.limits != EVERYTHING:
        weights[~_counted(image, *template.limits)] = 0.0
    return weights


def _counted(
    image: Image, minimum_saturation: float, minimum_value: float, maximum_value: float
) -> Mask:
    *_, largest, spread = _channels(image)
    saturated = spread >= minimum_saturation * largest
    return saturated & (largest >= minimum_value * 255.0) & (largest <= maximum_value * 255.0)


def _hue_bins(channels: tuple[Whole, ...], bins: int) -> Whole:
    blue, green, red, largest, spread = channels
    # Hue is sixths / (6 spread) of a turn.
    sixths = np.where(
        largest == red,
        np.where(green >= blue, green - blue, green - blue + 6 * spread),
        np.where(largest == green, blue - red + 2 * spread, red - green + 4 * spread),
    )
    return np.asarray(bins * sixths // (6 * np.maximum(spread, 1)))


def _saturation_bins(channels: tuple[Whole, ...], bins: int) -> Whole:
    *_, largest, spread = channels
    return np.asarray(np.minimum(bins * spread // np.maximum(largest, 1), bins - 1))


def _channels(image: Image) -> tuple[Whole, ...]:
    """Return blue, green, red, their maximum, and their range."""
    blue, green, red = np.moveaxis(image.astype(np.int64), 2, 0)
    largest = np.maximum(np.maximum(blue, green), red)
    return blue, green, red, largest, largest - np.minimum(np.minimum(blue, green), red)


def grey(image: Image) -> Whole:
    """Return the sum of the three channels; a constant factor would cancel in the threshold."""
    return np.asarray(image.sum(axis=2, dtype=np.int64))


def local_difference(image: Image, previous: Image, window: int = 5) -> Whole:
    """Return D1: absolute differences of `grey`, summed over a window around each pixel.

    The side of the window is odd [px]. Pixels outside of the image are ignored.
    """
    changed = np.pad(np.abs(grey(image) - grey(previous)), window // 2)
    rows, columns = image.shape[:2]
    across = np.sum([changed[:, left : left + columns] for left in range(window)], axis=0)
    return np.asarray(np.sum([across[top : top + rows] for top in range(window)], axis=0))


def motion_threshold(difference: Whole | Array, factor: float = 2.0) -> float:
    """Return T = mean + λ · standard deviation over the whole image."""
    return float(difference.mean() + factor * difference.std())


def moving(difference: Whole | Array, factor: float = 2.0) -> Mask:
    """Return B: pixels whose difference is above the threshold."""
    return np.asarray(difference > motion_threshold(difference, factor))


def joint_map(colour: Array, moving: Mask, beta: float = 0.8) -> Array:
    """Return P = (1 - β) I_c + β I_m with I_m = B · I_c (equation 5)."""
    return (1 - beta) * colour + beta * moving * colour


class JointMaps:
    """Maps of the current frame, from the template and the frames before.

    `alpha`, `beta`: weights of the hue and of the motion. `difference_window`: side n of local
    differences [px]. `differences`: "two" averages the last two differences, "one" takes the last.
    `threshold_factor`: λ of the adaptive threshold. `motion_threshold`: "adaptive", or a fixed mean
    absolute difference in the window [grey levels]. The limits are those of `Template`. Attributes:
    `colour`, `difference`, `moving` and `joint` are I_c, D, B and P of the last frame.
    """

    def __init__(
        self,
        alpha: float = 0.7,
        beta: float = 0.8,
        hue_bins: int = 32,
        saturation_bins: int = 32,
        difference_window: int = 5,
        differences: str = "two",
        threshold_factor: float = 2.0,
        motion_threshold: str | float = "adaptive",
        minimum_saturation: float = 0.0,
        minimum_value: float = 0.0,
        maximum_value: float = 1.0,
    ) -> None:
        self._alpha, self._beta = alpha, beta
        limits = minimum_saturation, minimum_value, maximum_value
        self._histograms = hue_bins, saturation_bins, limits
        self._window, self._averaged = difference_window, differences == "two"
        self._factor, self._fixed = threshold_factor, motion_threshold
        self._before: Whole | None = None

    def init(self, image: Image, box: Box) -> None:
        """Initialise the template with a box of the first frame."""
        self._template = make_template(image, box, *self._histograms)
        self._image, self._before = image, None

    def update(self, image: Image) -> None:
        """Compute the maps of the next frame."""
        self.colour = colour_map(image, self._template, self._alpha)
        latest = local_difference(image, self._image, self._window)
        self.difference: Array = latest.astype(float)
        if self._averaged and self._before is not None:
            self.difference = (latest + self._before) / 2
        self._image, self._before = image, latest
        if self._fixed == "adaptive":
            self.moving = moving(self.difference, self._factor)
        else:
            self.moving = self.difference > float(self._fixed) * 3 * self._window**2
        self.joint = joint_map(self.colour, self.moving, self._beta)
