"""Rules for plain trackers: classes with `init(image, box)` and `update(image)`.

`bench/external/worker.py` loads this file into interpreters of users. It therefore has the syntax
of Python 3.6, and needs NumPy only. The functions raise `ValueError` for unusable trackers.
"""

import inspect
import math
from difflib import get_close_matches
from functools import partial
from typing import Any, Callable, Dict, List

import numpy as np

IMAGES = ("bgr", "rgb", "grey")
"""Order of the channels of the images that a plain tracker gets: its class attribute `images`."""

_RANDOM = ("seed", "rng")


def missing_methods(tracker: Any) -> List[str]:
    """Return the methods of a tracker that a class or an object lacks."""
    abstract = getattr(tracker, "__abstractmethods__", ()) if isinstance(tracker, type) else ()
    try:
        methods = {name: getattr(tracker, name, None) for name in ("init", "update")}
    except Exception as error:  # code of the tracker, such as `__getattr__`
        raise ValueError(f"its attributes raise {type(error).__name__}: {error}.") from None
    return [name for name in methods if not callable(methods[name]) or name in abstract]


def check_methods(tracker: Any) -> None:
    """Raise `ValueError` if a class or an object lacks methods of a tracker."""
    missing = missing_methods(tracker)
    if missing:
        raise ValueError(
            f"it lacks {', '.join(missing)}. Expected: a class with the methods init(image, box) "
            "and update(image)."
        )


def tracker_class(module: Any, name: str) -> Any:
    """Return a class of a module; `name` can be empty if it defines only one tracker."""
    tracker_type = getattr(module, name or _only_tracker(module), None)
    if not isinstance(tracker_type, type):
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        close = get_close_matches(name, classes, n=1)
        class_names = ", ".join(classes) or "none"
        hint = f"Did you mean {close[0]!r}?" if close else f"Known: {class_names}."
        raise ValueError(f"the file has no class {name!r}. {hint}")  # noqa: TRY004  # as all errors of this module
    return tracker_type


def _only_tracker(module: Any) -> Any:
    """Return the name of the only tracker class that a module defines."""
    defined = {
        name: value
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__
    }
    missing = {name: len(missing_methods(defined[name])) for name in defined}
    fewest = min(missing.values(), default=2)
    # If no class has both methods, the error of the returned class names the missing one.
    trackers = [name for name in defined if missing[name] == fewest < 2]
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
    """Return the properties of a class, or of a function that creates a tracker."""
    if isinstance(make, type):
        if any(base.__name__ == "TrackerPlugin" for base in make.__mro__):
            raise ValueError("it derives from TrackerPlugin. Omit python=, or write a plain class.")
        check_methods(make)
        adapt_init(_bound(make, "init"))  # raises ValueError
    name, parameters = getattr(make, "name", ""), _parameters(make)
    is_random = any(key in _signature(make).parameters for key in _RANDOM)
    return {
        "class": getattr(make, "__name__", "tracker"),
        "doc": make.__doc__,
        "name": name if isinstance(name, str) else "",  # it can be a property
        "parameters": parameters,
        "randomness": getattr(make, "randomness", "generator" if is_random else "none"),
        "images": declared_images(make),
    }


def declared_images(make: Any) -> str:
    """Return the class attribute `images`; raise `ValueError` for an unknown text.

    An attribute of another type than text has another meaning, and is ignored.
    """
    images = getattr(make, "images", IMAGES[0])
    if not isinstance(images, str):
        return IMAGES[0]
    if images not in IMAGES:
        raise ValueError(
            f"its class attribute images is {images!r}. Expected one of: {', '.join(IMAGES)}."
        )
    return str(images)


def _bound(tracker_type: Any, name: str) -> Any:
    """Return a method of a class as its objects have it: without `self`."""
    method, stored = getattr(tracker_type, name), inspect.getattr_static(tracker_type, name)
    is_function = hasattr(type(stored), "__get__")  # otherwise, a callable object
    takes_self = is_function and not isinstance(stored, (staticmethod, classmethod))
    return partial(method, None) if takes_self else method


def _parameters(make: Any) -> Dict[str, Any]:
    """Return the arguments whose defaults are numbers, text, true or false, with these defaults.

    A whole number is a default of type float if the annotation is `float`.
    """
    parameters = {}
    for name, argument in _signature(make).parameters.items():
        value = argument.default
        if name in _RANDOM or argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD):
            continue
        if value is argument.empty:
            raise ValueError(
                f"the argument {name!r} has no default. Expected: defaults for all arguments "
                "except seed and rng."
            )
        if type(value) is int and argument.annotation in (float, "float"):
            value = float(value)
        is_number = type(value) in (int, float) and math.isfinite(value)
        if (is_number or type(value) in (bool, str)) and not name.startswith("_"):
            parameters[name] = value
    return parameters


def create(make: Any, parameters: Dict[str, Any], seed: int, sequence: Callable[[], Any]) -> Any:
    """Return a new tracker.

    `seed` is its argument of this name. `sequence` returns the `SeedSequence` for its argument
    `rng`; versions of NumPy before 1.17 do not have this class.
    """
    arguments, values = _signature(make).parameters, dict(parameters)
    if "seed" in arguments:
        values["seed"] = seed
    if "rng" in arguments:
        values["rng"] = np.random.default_rng(sequence())
    return make(**values)


def adapt_init(init: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of image, box and mask that calls `init`, with the mask if it takes one."""
    signature = _signature(init)
    takes_mask = "mask" in signature.parameters

    def adapted(image: Any, box: Any, mask: Any) -> Any:
        return init(image, box, **({"mask": mask} if takes_mask else {}))

    try:
        signature.bind(None, None, **({"mask": None} if takes_mask else {}))
    except TypeError:
        raise ValueError(
            f"init takes {signature}. Expected: init(image, box) or init(image, box, mask)."
        ) from None
    return adapted


def _signature(function: Callable[..., Any]) -> inspect.Signature:
    try:
        return inspect.signature(function)
    except ValueError as error:
        raise ValueError(
            f"{function!r} has no signature ({error}). Call it in a class or function of Python."
        ) from None
