"""Check of estimates: the values that `update` of a tracker can return, and in which forms.

All trackers pass this check: classes, trackers in other interpreters and trackers that speak TraX.
`bench/external/worker.py` loads this file into interpreters of users. It therefore has the syntax
of Python 3.6, and needs NumPy only.
"""

import math
import numbers
from collections.abc import Mapping
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

FIELDS = ("box", "visible", "confidence", "mask", "details")
"""Fields of an estimate that a tracker without a base class can return."""

NO_TARGET = [0.0, 0.0, 0.0, 0.0]
"""Box by which trackers of the VOT challenge report that the target is not visible."""

_MAX_TEXT = 80  # characters of a value in a message


class MalformedEstimateError(ValueError):
    """Invalid return value of a tracker."""


def read_estimate(returned: Any, shape: Tuple[int, ...]) -> Dict[str, Any]:
    """Return the fields of the estimate that `update` returned, in plain types.

    `returned` is four numbers, `(box, confidence)`, or a mapping or an object with `box` and other
    fields of an estimate, which can be None if they are unknown. `shape` is that of the image.

    The result has all of `FIELDS`. Its `box` has four finite floats, of which width and height are
    above 0. It is None, and `visible` is false, if the tracker reports no target: by None or
    `NO_TARGET` in place of the box, or by `visible` without a box.

    Raises `MalformedEstimateError` for any other value.
    """
    if type(returned) is np.ndarray or (type(returned) in (list, tuple) and len(returned) == 4):
        box = read_box(returned, no_target=True)  # the usual form, without the time of the others
        is_seen = box is not None
        return {"box": box, "visible": is_seen, "confidence": math.nan, "mask": None, "details": {}}
    fields = {name: value for name, value in _fields(returned).items() if value is not None}
    box = read_box(fields["box"], no_target=True) if "box" in fields else None
    mask = fields.get("mask")
    return {
        "box": box,
        "visible": _read_visible(fields.get("visible", True)) and box is not None,
        "confidence": _read_confidence(fields.get("confidence", math.nan)),
        "mask": None if mask is None else _read_mask(mask, shape),
        "details": _read_details(fields.get("details", {})),
    }


def read_box(box: Any, no_target: bool = False) -> Optional[List[float]]:
    """Return a box as `[x, y, width, height]`, if it is finite and its size positive.

    With `no_target`, the box `NO_TARGET` is valid too, and gives None.

    Raises `MalformedEstimateError` for any other value. Text, true and false are not numbers.
    """
    if type(box) is np.ndarray and box.dtype == np.float64 and box.shape == (4,):
        return _check_numbers(box.tolist(), no_target)
    values = _array_of(box)
    if isinstance(values, np.ndarray) and values.shape == (4,) and values.dtype.kind in "fiuO":
        values = values.tolist()
    is_list = isinstance(values, (list, tuple)) and len(values) == 4
    numbers_or_none = [_real_number(value) for value in values] if is_list else [None]
    if None in numbers_or_none:
        raise MalformedEstimateError(
            f"the box is {value_text(box)}. Expected: four numbers [x, y, width, height] as an "
            "array, list or tuple"
        )
    return _check_numbers([number or 0.0 for number in numbers_or_none], no_target)


def _check_numbers(box: List[float], no_target: bool) -> Optional[List[float]]:
    """Return a box of four floats, or None for `NO_TARGET`; see `read_box`."""
    if no_target and box == NO_TARGET:
        return None
    x, y, width, height = box
    # These comparisons also reject NaN.
    is_finite = -math.inf < x < math.inf and -math.inf < y < math.inf
    if not (is_finite and 0 < width < math.inf and 0 < height < math.inf):
        raise MalformedEstimateError(
            f"the box {box} is invalid. Expected: finite numbers, positive width and height"
        )
    return box


def value_text(value: Any) -> str:
    """Return a value as one line of text for a message; its `repr` may fail."""
    if hasattr(type(value), "__array__"):
        array = _array_of(value)
        if isinstance(array, np.ndarray) and array.shape != (4,):
            return f"an array of shape {array.shape} and type {array.dtype}"
    try:
        line = " ".join(repr(value).split())
    except Exception:  # code of the tracker
        line = f"an object of type {type(value).__name__}"
    return line if len(line) <= _MAX_TEXT else line[: _MAX_TEXT - 3] + "..."


def _fields(returned: Any) -> Dict[str, Any]:
    """Return the fields of an estimate in one of the forms of `read_estimate`, without a check."""
    if type(returned) not in (tuple, list):
        if isinstance(returned, Mapping):
            return _mapping_fields(dict(returned))
        named = _attributes(returned)
        if "box" in named:
            return named
    if not (isinstance(returned, (tuple, list)) and len(returned) == 2):
        return {"box": returned}
    first, second = returned
    is_array = type(first) is np.ndarray and first.ndim > 0  # neither a truth value nor a number
    if not is_array and _is_truth(first):
        raise MalformedEstimateError(
            f"update returned {value_text(returned)}. This looks like (ok, box), as OpenCV's "
            "trackers return it. Return the box, or (box, confidence); return None if the target "
            "is lost"
        )
    if not is_array and _real_number(first) is not None:
        raise MalformedEstimateError(
            f"update returned {value_text(returned)}. Expected: (box, confidence), in this order"
        )
    return {"box": first, "confidence": second}


def _mapping_fields(fields: Dict[Any, Any]) -> Dict[str, Any]:
    """Return the fields that a dict has; raise an error if the box is missing by mistake."""
    is_lost = "visible" in fields and fields["visible"] is not None
    is_lost = is_lost and not _read_visible(fields["visible"])
    if not set(fields) <= set(FIELDS) or not ("box" in fields or is_lost):
        keys = ", ".join(map(value_text, fields)) or "(none)"
        raise MalformedEstimateError(
            f"update returned a dict with the keys {keys}. Expected: 'box', and only the keys "
            f"{', '.join(FIELDS)}"
        )
    return fields


def _attributes(returned: Any) -> Dict[str, Any]:
    """Return the fields of an estimate that are attributes of an object."""
    try:
        return {name: getattr(returned, name) for name in FIELDS if hasattr(returned, name)}
    except Exception as error:  # code of the tracker, such as `__getattr__`
        raise MalformedEstimateError(
            f"update returned an object of type {type(returned).__name__}, whose attributes raise "
            f"{value_text(error)}"
        ) from None


def _read_visible(visible: Any) -> bool:
    """Return a truth value; the numbers 0 and 1 are truth values, too."""
    if visible is True or _is_truth(visible):
        return bool(visible)
    if _real_number(visible) in (0.0, 1.0):
        return _real_number(visible) == 1.0
    raise MalformedEstimateError(
        f"visible is {value_text(visible)}. Expected: true or false (bool)"
    )


def _is_truth(value: Any) -> bool:
    """Return whether a value is true or false, also as an array without dimensions."""
    value = _array_of(value)
    return isinstance(value, (bool, np.bool_)) or (
        isinstance(value, np.ndarray) and value.shape == () and value.dtype == np.bool_
    )


def _read_confidence(confidence: Any) -> float:
    value = _real_number(confidence)
    if value is None:
        raise MalformedEstimateError(
            f"the confidence is {value_text(confidence)}. Expected: a number in [0, 1], or NaN"
        )
    if not (0.0 <= value <= 1.0 or math.isnan(value)):
        raise MalformedEstimateError(f"the confidence {value} is not in [0, 1] or NaN")
    return value


def _read_mask(mask: Any, shape: Tuple[int, ...]) -> Any:
    array = _array_of(mask)
    if not isinstance(array, np.ndarray):
        raise MalformedEstimateError(
            f"the mask is of type {type(mask).__name__}. Expected: an array of bool"
        )
    if array.dtype != np.bool_ or array.shape != tuple(shape[:2]):
        raise MalformedEstimateError(
            f"the mask is {array.dtype} of shape {array.shape}. Expected: bool of the image's "
            f"shape {tuple(shape[:2])}"
        )
    return array


def _read_details(details: Any) -> Dict[str, float]:
    if not isinstance(details, Mapping):
        raise MalformedEstimateError(
            f"the details are {value_text(details)}. Expected: a dict of numbers by name"
        )
    values = {}
    for name, value in details.items():
        detail = math.nan if value is None else _real_number(value)
        if _is_truth(value):
            detail = float(value)
        if detail is None or not isinstance(name, str):
            raise MalformedEstimateError(
                f"details[{value_text(name)}] is {value_text(value)}. Expected: a number by its "
                "name; details are numbers"
            )
        values[name] = detail
    return values


def _real_number(value: Any) -> Optional[float]:
    """Return a real number, also of NumPy or of another library, as a float; None otherwise."""
    if type(value) is float:
        return value
    if hasattr(type(value), "__array__") and not isinstance(value, np.generic):
        value = _array_of(value)
        if not isinstance(value, np.ndarray) or value.shape != ():
            return None
        value = value[()]
    if isinstance(value, numbers.Real):
        is_real = not isinstance(value, bool)
    else:
        is_real = hasattr(type(value), "__float__") and not isinstance(value, np.generic)
    try:
        return float(value) if is_real else None
    except Exception:  # code of the tracker; or an integer above the range of float
        return None


def _array_of(value: Any) -> Any:
    """Return an array or a tensor as an array of NumPy; other values unchanged."""
    if isinstance(value, np.generic) or not hasattr(type(value), "__array__"):
        return value
    if np.ma.is_masked(value):  # the conversion would return the hidden values
        raise MalformedEstimateError("an array has masked values. Expected: numbers, or None")
    try:
        return np.asarray(value)
    except Exception as error:  # a tensor on a GPU
        raise MalformedEstimateError(
            f"a value of type {type(value).__name__} cannot be converted to an array "
            f"({value_text(error)})"
        ) from None
