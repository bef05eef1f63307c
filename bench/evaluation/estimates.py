"""Checks of estimates: the values that a tracker returns must be usable.

Each check returns plain values and raises `MalformedEstimateError` otherwise.
"""

from math import inf, isnan
from typing import Any

import numpy as np

from trackmark.trackers import Estimate, Mask

_NUMBER_KINDS = "fiubO"  # array kinds of real numbers, and of objects that convert to them


class MalformedEstimateError(ValueError):
    """Return value of a tracker that is not a valid estimate."""


def checked_box(box: Any) -> list[float]:
    """Return `[x, y, width, height]`: finite numbers, with positive width and height."""
    is_array = isinstance(box, np.ndarray)
    is_sequence = isinstance(box, list | tuple) and all(map(np.isscalar, box))
    plain = np.asarray(box) if is_array or is_sequence else None
    if plain is None or plain.shape != (4,) or plain.dtype.kind not in _NUMBER_KINDS:
        raise MalformedEstimateError(
            f"the box is {box!r}. Expected: four numbers [x, y, width, height] as an array, list "
            "or tuple"
        )
    # Check the stored values: a number that is finite in another type may overflow float64.
    numbers = list(map(float, plain.tolist()))
    x, y, width, height = numbers
    # NaN fails every comparison, so these comparisons also reject NaN.
    if not (-inf < x < inf and -inf < y < inf and 0 < width < inf and 0 < height < inf):
        raise MalformedEstimateError(f"the box {numbers} is not finite with a positive size")
    return numbers


def checked_estimate(estimate: Any) -> tuple[list[float], float]:
    """Return box and confidence of an estimate."""
    if not isinstance(estimate, Estimate):
        raise MalformedEstimateError(f"update returned {estimate!r}, not an Estimate")
    confidence = float(estimate.confidence)
    if not (0.0 <= confidence <= 1.0 or isnan(confidence)):
        raise MalformedEstimateError(f"the confidence {confidence} is not in [0, 1]")
    return checked_box(estimate.box), confidence


def checked_mask(mask: Any, shape: tuple[int, ...]) -> Mask:
    """Return the mask as a plain array."""
    if not isinstance(mask, np.ndarray):
        raise MalformedEstimateError(f"the mask is {type(mask).__name__}, not an array of bool")
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise MalformedEstimateError(
            f"the mask is {mask.dtype} of shape {mask.shape}, not bool of the image's shape {shape}"
        )
    return np.asarray(mask)
