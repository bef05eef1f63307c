"""Validation of estimates, which a tracker returns.

Each function returns the values in plain types, or raises `MalformedEstimateError`.
"""

from math import inf, isnan
from typing import Any

import numpy as np

from trackmark.trackers import Estimate, Mask

_NUMBER_KINDS = "fiubO"  # array kinds of real numbers, and of objects that convert to them


class MalformedEstimateError(ValueError):
    """Invalid return value of a tracker."""


def validate_box(box: Any) -> list[float]:
    """Return a box as `[x, y, width, height]`, if it is finite and its size positive."""
    is_array = isinstance(box, np.ndarray)
    is_sequence = isinstance(box, list | tuple) and all(map(np.isscalar, box))
    plain = np.asarray(box) if is_array or is_sequence else None
    if plain is None or plain.shape != (4,) or plain.dtype.kind not in _NUMBER_KINDS:
        text = f"an array of shape {box.shape}" if is_array and box.size > 8 else repr(box)
        raise MalformedEstimateError(
            f"the box is {text}. Expected: four numbers [x, y, width, height] as an array, list "
            "or tuple"
        )
    # Checks the converted values: a finite number of another type can overflow float64.
    numbers = list(map(float, plain.tolist()))
    x, y, width, height = numbers
    # These comparisons also reject NaN.
    if not (-inf < x < inf and -inf < y < inf and 0 < width < inf and 0 < height < inf):
        raise MalformedEstimateError(
            f"the box {numbers} is invalid. Expected: finite numbers, positive width and height"
        )
    return numbers


def validate_estimate(estimate: Any) -> tuple[list[float], float]:
    """Return box and confidence of an estimate."""
    if not isinstance(estimate, Estimate):
        raise MalformedEstimateError(f"update returned {estimate!r}. Expected: an Estimate")
    try:
        confidence = float(estimate.confidence)
    except (TypeError, ValueError):
        raise MalformedEstimateError(
            f"the confidence is {estimate.confidence!r}. Expected: a number in [0, 1], or NaN"
        ) from None
    if not (0.0 <= confidence <= 1.0 or isnan(confidence)):
        raise MalformedEstimateError(f"the confidence {confidence} is not in [0, 1] or NaN")
    return validate_box(estimate.box), confidence


def validate_mask(mask: Any, shape: tuple[int, ...]) -> Mask:
    """Return the mask as a plain array."""
    if not isinstance(mask, np.ndarray):
        raise MalformedEstimateError(
            f"the mask is of type {type(mask).__name__}. Expected: an array of bool"
        )
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise MalformedEstimateError(
            f"the mask is {mask.dtype} of shape {mask.shape}. Expected: bool of the image's shape "
            f"{shape}"
        )
    return np.asarray(mask)
