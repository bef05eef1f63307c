"""Rules for plain trackers: classes with `init(image, box)` and `update(image)`.

`bench/external/worker.py` loads this file into interpreters of users. It therefore has the syntax
of Python 3.6, and needs NumPy only. The functions raise `ValueError` for unusable trackers.
"""

import inspect
import math
from collections.abc import Mapping
from difflib import get_close_matches
from functools import partial
from typing import Any, Callable, Dict, List

import numpy as np

FIELDS = ("box", "visible", "confidence", "mask", "details", "arrays", "revised")
"""Fields of an estimate."""

_RANDOM = ("seed", "rng")


def missing_methods(tracker: Any) -> List[str]:
    """Return the methods of a tracker that a class or an object lacks."""
    abstract = getattr(tracker, "__abstractmethods__", ())
    methods = {name: getattr(tracker, name, None) for name in ("init", "update")}
    return [name for name in methods if not callable(methods[name]) or name in abstract]


def check_methods(tracker: Any) -> None:
    """Raise `ValueError` if a class or an object lacks methods of a tracker."""
    missing = missing_methods(tracker)
    if missing:
        raise ValueError(
            f"it lacks {', '.join(missing)}. Expected: a class with the methods init(image, box) "
            "and update(image)."
        )


def is_plugin(kind: Any) -> bool:
    """Return whether a class derives from `TrackerPlugin`, which this module cannot import."""
    return any(base.__name__ == "TrackerPlugin" for base in getattr(kind, "__mro__", ()))


def tracker_class(module: Any, name: str) -> Any:
    """Return a class of a module; `name` can be empty if it defines only one tracker."""
    kind = getattr(module, name or _only_tracker(module), None)
    if not isinstance(kind, type):
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        close = get_close_matches(name, classes, n=1)
        class_names = ", ".join(classes) or "none"
        hint = f"Did you mean {close[0]!r}?" if close else f"Known: {class_names}."
        raise ValueError(f"the file has no class {name!r}. {hint}")  # noqa: TRY004  # as all errors of this module
    return kind


def _only_tracker(module: Any) -> Any:
    """Return the name of the only tracker class that a module defines.

    Plain trackers count only if the module defines no `TrackerPlugin`.
    """
    defined = {
        name: value
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__
    }
    trackers = [name for name in defined if is_plugin(defined[name])]
    trackers = trackers or [name for name in defined if not missing_methods(defined[name])]
    classes = [name for name in trackers if not inspect.isabstract(defined[name])] or trackers
    exported = [name for name in classes if name in getattr(module, "__all__", classes)]
    if not classes:
        raise ValueError(
            "the file defines no tracker. Expected: a class with the methods init(image, box) and "
            "update(image)."
        )
    if len(exported) != 1:
        raise ValueError(
            f"the file defines several trackers: {', '.join(classes)}. Select one, for example "
            f"{module.__file__}:{classes[0]}."
        )
    return exported[0]


def describe(make: Any) -> Dict[str, Any]:
    """Return the properties of a class, or of a function that creates a tracker.

    Parameters of the tracker are the arguments whose defaults are numbers, text, true or false.
    """
    if isinstance(make, type):
        check_methods(make)
        adapt_init(partial(make.init, None))  # type: ignore[attr-defined]  # raises ValueError
    name, is_random = getattr(make, "name", ""), False
    if is_plugin(make):
        fields = make.Parameters.model_fields.items()
        defaults = {key: field.get_default(call_default_factory=True) for key, field in fields}
    else:
        defaults = _defaults(make)
        is_random = any(key in _signature(make).parameters for key in _RANDOM)
    return {
        "class": getattr(make, "__name__", "tracker"),
        "doc": make.__doc__,
        "name": name if isinstance(name, str) else "",  # it can be a property
        "parameters": {key: value for key, value in defaults.items() if _is_simple(key, value)},
        "randomness": getattr(make, "randomness", "generator" if is_random else "none"),
    }


def _defaults(make: Any) -> Dict[str, Any]:
    """Return the arguments that do not depend on the run, with their defaults.

    A whole number is a default of type float if the annotation is `float`.
    """
    defaults = {}
    for name, argument in _signature(make).parameters.items():
        value = argument.default
        if name in _RANDOM or argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD):
            continue
        if value is argument.empty:
            raise ValueError(
                f"the argument {name!r} has no default. Expected: defaults for all arguments "
                "except seed and rng."
            )
        converted = type(value) is int and argument.annotation in (float, "float")
        defaults[name] = float(value) if converted else value
    return defaults


def _is_simple(name: str, value: Any) -> bool:
    """Return whether an argument with this default value can be a parameter of the tracker."""
    simple = type(value) in (bool, int, str) or (type(value) is float and math.isfinite(value))
    return simple and not name.startswith("_")


def create(make: Any, parameters: Dict[str, Any], seed: int, sequence: Callable[[], Any]) -> Any:
    """Return a new tracker.

    `seed` is its argument of this name. `sequence` returns the `SeedSequence` for its argument
    `rng`; versions of NumPy before 1.17 do not have this class.
    """
    if is_plugin(make):
        return make(make.Parameters(**parameters), sequence())
    arguments = _signature(make).parameters
    values = dict(parameters)
    if "seed" in arguments:
        values["seed"] = seed
    if "rng" in arguments:
        values["rng"] = np.random.default_rng(sequence())
    return make(**values)


def adapt_init(init: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of image, box and mask that calls `init`, with the mask if it takes one."""
    signature = _signature(init)

    def accepts(*arguments: Any, **keywords: Any) -> bool:
        try:
            signature.bind(*arguments, **keywords)
        except TypeError:
            return False
        return True

    mask = signature.parameters.get("mask")
    if mask is not None and mask.kind is not mask.POSITIONAL_ONLY:
        if accepts(None, None, mask=None):
            return lambda image, box, mask: init(image, box, mask=mask)
    elif accepts(None, None):
        return lambda image, box, _: init(image, box)
    elif accepts(None, None, None):
        return init
    raise ValueError(
        f"init takes {signature}. Expected: init(image, box) or init(image, box, mask)."
    )


def estimate_fields(answer: Any) -> Dict[str, Any]:
    """Return the fields of the estimate that `update` returned.

    `answer` is four numbers, `(box, confidence)`, or a dict or an object with `box` and other
    fields of an estimate. The harness validates the values.
    """
    if hasattr(answer, "box"):
        answer = {name: getattr(answer, name) for name in FIELDS if hasattr(answer, name)}
    if isinstance(answer, Mapping):
        fields = dict(answer)
        if "box" not in fields or not set(fields) <= set(FIELDS):
            raise ValueError(
                f"update returned a dict with the keys {', '.join(map(repr, fields))}. Expected: "
                f"'box', and only fields of an Estimate ({', '.join(FIELDS)})."
            )
    elif isinstance(answer, (tuple, list)) and len(answer) == 2:
        fields = {"box": answer[0], "confidence": answer[1]}
    else:
        fields = {"box": answer}
    if hasattr(fields["box"], "__array__"):  # for example a tensor
        fields["box"] = np.asarray(fields["box"])
    return fields


def _signature(function: Callable[..., Any]) -> inspect.Signature:
    try:
        return inspect.signature(function)
    except ValueError as error:
        raise ValueError(
            f"{function!r} has no signature ({error}). Call it in a class or function of Python."
        ) from None
