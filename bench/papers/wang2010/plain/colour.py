"""The colour model: histograms of hue and saturation, and their back-projection (equation 3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.papers.wang2010.plain.windows import whole_size, window_slices

__all__ = ["Template", "colour_bins", "colour_map", "hue_map", "make_template"]

Bins = NDArray[np.int64]
Map = NDArray[np.float64]


class Template(NamedTuple):
    """What the target looks like in the first frame.

    Attributes
    ----------
    hue, saturation : ndarray of float64, shape (bins,)
        Histograms, over their largest bin.
    minimum_saturation, minimum_value, maximum_value : float
        Pixels below either of the first or above the last count for nothing, here and in maps
        [fractions].
    """

    hue: Map
    saturation: Map
    minimum_saturation: float = 0.0
    minimum_value: float = 0.0
    maximum_value: float = 1.0


def colour_bins(
    image: NDArray[np.uint8], hue_bins: int = 32, saturation_bins: int = 32
) -> tuple[Bins, Bins]:
    """Bins of hue and saturation as MATLAB's `rgb2hsv` has them, in whole numbers.

    Parameters
    ----------
    image : ndarray of uint8, shape (rows, columns, 3)
        BGR.

    Returns
    -------
    hue, saturation : ndarray of int64, shape (rows, columns)
        Grey pixels have hue 0, black ones saturation 0.
    """
    channels = _channels(image)
    return _hue_bins(channels, hue_bins), _saturation_bins(channels, saturation_bins)


def make_template(
    image: NDArray[np.uint8],
    box: NDArray[np.float64],
    hue_bins: int = 32,
    saturation_bins: int = 32,
    minimum_saturation: float = 0.0,
    minimum_value: float = 0.0,
    maximum_value: float = 1.0,
) -> Template:
    """Histograms of all pixels of a rectangle.

    Raises
    ------
    ValueError
        Where none of them counts.
    """
    x, y, width, height = box.tolist()
    size = whole_size(width), whole_size(height)
    patch = image[window_slices(image.shape, x + width / 2, y + height / 2, *size)]
    limits = minimum_saturation, minimum_value, maximum_value
    counted = _counted(patch, *limits)
    if not counted.any():
        raise ValueError(f"no pixel of the box {box.tolist()} counts; give another box.")
    hue, saturation = colour_bins(patch, hue_bins, saturation_bins)
    hues = np.bincount(hue[counted], minlength=hue_bins)
    saturations = np.bincount(saturation[counted], minlength=saturation_bins)
    return Template(hues / hues.max(), saturations / saturations.max(), *limits)


def hue_map(image: NDArray[np.uint8], template: Template) -> Map:
    """I_h: how frequent each pixel's hue is in the template, in [0, 1]."""
    found = template.hue[_hue_bins(_channels(image), len(template.hue))]
    return _without_uncounted(found, image, template)


def colour_map(image: NDArray[np.uint8], template: Template, alpha: float = 0.7) -> Map:
    """I_c = α I_h + (1 - α) I_s, in [0, 1] (equation 3)."""
    hue, saturation = colour_bins(image, len(template.hue), len(template.saturation))
    found = alpha * template.hue[hue] + (1 - alpha) * template.saturation[saturation]
    return _without_uncounted(found, image, template)


def _without_uncounted(found: Map, image: NDArray[np.uint8], template: Template) -> Map:
    limits = template[2:]
    if limits != (0.0, 0.0, 1.0):
        found[~_counted(image, *limits)] = 0.0
    return found


def _counted(
    image: NDArray[np.uint8], minimum_saturation: float, minimum_value: float, maximum_value: float
) -> NDArray[np.bool_]:
    *_, largest, spread = _channels(image)
    saturated = spread >= minimum_saturation * largest
    return saturated & (largest >= minimum_value * 255.0) & (largest <= maximum_value * 255.0)


def _hue_bins(channels: tuple[Bins, ...], bins: int) -> Bins:
    blue, green, red, largest, spread = channels
    # Hue is sixths / (6 spread) of a turn.
    sixths = np.where(
        largest == red,
        np.where(green >= blue, green - blue, green - blue + 6 * spread),
        np.where(largest == green, blue - red + 2 * spread, red - green + 4 * spread),
    )
    return np.asarray(bins * sixths // (6 * np.maximum(spread, 1)))


def _saturation_bins(channels: tuple[Bins, ...], bins: int) -> Bins:
    *_, largest, spread = channels
    return np.asarray(np.minimum(bins * spread // np.maximum(largest, 1), bins - 1))


def _channels(image: NDArray[np.uint8]) -> tuple[Bins, ...]:
    """Blue, green and red, the largest of them, and how far they spread."""
    blue, green, red = np.moveaxis(image.astype(np.int64), 2, 0)
    largest = np.maximum(np.maximum(blue, green), red)
    return blue, green, red, largest, largest - np.minimum(np.minimum(blue, green), red)
