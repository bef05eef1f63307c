"""Adapter of plain trackers: classes with `init(image, box)` and `update(image)`, without imports.

`to_plugin` turns such a class into a `TrackerPlugin`. The other functions are its parts; trackers
in other processes use them too.
"""

import inspect
import math
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from functools import partial
from typing import Any, ClassVar

import numpy as np
from pydantic import create_model

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters, TrackerError

OPTIONAL_METHODS = ("watch", "finish", "maps")
"""Methods of `Watcher`, `Finisher` and `Mapper`, which are called if a tracker has them."""

_RANDOM = ("seed", "rng")
_SIMPLE = (bool, int, float, str)
_FIELDS = tuple(field.name for field in fields(Estimate))


class PlainTracker(TrackerPlugin):
    """Plugin that calls a plain tracker; see `to_plugin`.

    `make` creates the plain tracker.
    """

    make: ClassVar[Callable[..., Any]]

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        make = type(self).make
        self._tracker = make(**parameters.model_dump(), **random_arguments(make, seed))
        name = type(self).__name__
        _check_methods(self._tracker, name)
        self._mask_argument = mask_argument(self._tracker.init, name)
        for method in OPTIONAL_METHODS:
            if callable(getattr(self._tracker, method, None)):
                setattr(self, method, getattr(self._tracker, method))

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        if self._mask_argument == "keyword":
            self._tracker.init(image, box, mask=mask)
        elif self._mask_argument == "position":
            self._tracker.init(image, box, mask)
        else:
            self._tracker.init(image, box)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        return to_estimate(self._tracker.update(image))


def missing_methods(tracker: Any) -> list[str]:
    """Return the methods of a tracker that a class or an object lacks."""
    return [name for name in ("init", "update") if not callable(getattr(tracker, name, None))]


def _check_methods(tracker: Any, name: str) -> None:
    if missing := missing_methods(tracker):
        raise TrackerError(
            f"tracker {name!r}: it lacks {', '.join(missing)}. Expected: a class with the methods "
            "init(image, box) and update(image)."
        )


def to_plugin(make: Callable[..., Any], name: str = "") -> type[PlainTracker]:
    """Return the plugin class of a plain tracker.

    Parameters
    ----------
    make : type or callable
        Class with the methods `init` and `update`, or a function that creates such an object.
        Arguments called `seed` (an int) or `rng` (a `numpy.random.Generator`) get values that
        depend on the run. Other arguments need defaults. If the default is a number, text, true or
        false, the argument is a parameter of the tracker.
    name : str
        Name of the tracker in messages; by default the name of `make`.

    Returns
    -------
    type
        Class derived from `PlainTracker`. Its source of random numbers is the class attribute
        `randomness`, if there is one. Otherwise it is a generator if `make` takes `seed` or `rng`.

    Raises
    ------
    TrackerError
        If a method is missing, or if `make` or `init` cannot be called.
    """
    own_name = getattr(make, "__name__", "tracker")
    name = name or own_name
    if isinstance(make, type):
        _check_methods(make, name)
        mask_argument(partial(make.init, None), name)  # type: ignore[attr-defined]
    arguments = _signature(make)
    for argument in arguments.values():
        variable = argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD)
        if argument.default is argument.empty and not variable and argument.name not in _RANDOM:
            raise TrackerError(
                f"tracker {name!r}: the argument {argument.name!r} has no default. Expected: "
                "defaults for all arguments except seed and rng."
            )
    default = Randomness.NONE if arguments.keys().isdisjoint(_RANDOM) else Randomness.GENERATOR
    declared: Any = getattr(make, "randomness", default)
    try:
        randomness = Randomness(declared)
    except ValueError:
        raise TrackerError(
            f"tracker {name!r}: the randomness is {declared!r}. Expected one of: "
            f"{', '.join(Randomness)}."
        ) from None
    attributes = {
        "__module__": make.__module__,
        "__qualname__": getattr(make, "__qualname__", own_name),
        "__doc__": make.__doc__,
        "name": getattr(make, "name", ""),
        "randomness": randomness,
        "Parameters": create_parameters(_defaults(make)),
        "make": staticmethod(make),
    }
    return type(own_name, (PlainTracker,), attributes)


def create_parameters(defaults: Mapping[str, Any]) -> type[Parameters]:
    """Return the parameters with these default values: numbers, text, true or false."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a name such as `copy` hides a method
        model: type[Parameters] = create_model(
            "PlainParameters",
            __base__=Parameters,
            **{name: (type(value), value) for name, value in defaults.items()},  # type: ignore[call-overload]
        )
    return model


def random_arguments(make: Callable[..., Any], seed: np.random.SeedSequence) -> dict[str, Any]:
    """Return the arguments of `make` that are derived from the seed of a run.

    `seed` is an int in [0, 2³¹), which all libraries accept; `rng` is a generator.
    """
    values = {"seed": int(seed.generate_state(1)[0]) >> 1, "rng": np.random.default_rng(seed)}
    return {name: value for name, value in values.items() if name in _signature(make)}


def mask_argument(init: Callable[..., Any], name: str) -> str:
    """Return how a bound `init` takes the mask: `keyword`, `position`, or empty for not at all.

    `name` is the tracker's name. Raises `TrackerError` if `init` accepts neither (image, box) nor
    (image, box, mask).
    """
    mask, signature = _signature(init).get("mask"), inspect.signature(init)
    calls: dict[str, tuple[int, dict[str, None]]] = {"": (2, {}), "position": (3, {})}
    if mask is not None and mask.kind is not mask.POSITIONAL_ONLY:
        calls = {"keyword": (2, {"mask": None})}
    for way, (arguments, keywords) in calls.items():
        with suppress(TypeError):
            signature.bind(*[None] * arguments, **keywords)
            return way
    raise TrackerError(
        f"tracker {name!r}: init takes {signature}. Expected: init(image, box) or init(image, "
        "box, mask)."
    )


def to_estimate(answer: Any) -> Estimate:
    """Return the value that `update` of a plain tracker returned as an `Estimate`.

    `answer` is an `Estimate`, four numbers, `(box, confidence)`, or a dict or an object with `box`
    and other fields of `Estimate`. The harness validates the values.

    Raises `TrackerError` for a dict without `box` or with unknown keys.
    """
    if isinstance(answer, Estimate):
        return answer
    if hasattr(answer, "box"):
        answer = {name: getattr(answer, name) for name in _FIELDS if hasattr(answer, name)}
    if isinstance(answer, Mapping):
        if "box" not in answer or not set(answer) <= set(_FIELDS):
            raise TrackerError(
                f"update returned a dict with the keys {', '.join(map(repr, answer))}. Expected: "
                f"'box', and only fields of an Estimate ({', '.join(_FIELDS)})."
            )
        return Estimate(**{**answer, "box": _to_box(answer["box"])})
    if isinstance(answer, tuple | list) and len(answer) == 2:
        return Estimate(_to_box(answer[0]), confidence=answer[1])
    return Estimate(_to_box(answer))


def _to_box(box: Any) -> Any:
    """Return arrays of other libraries, such as tensors, as NumPy arrays."""
    return np.asarray(box) if hasattr(box, "__array__") else box


def _signature(function: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return the arguments of a function or class by name."""
    try:
        return inspect.signature(function).parameters
    except ValueError as error:
        raise TrackerError(
            f"{function!r} has no signature ({error}). Call it in a class or function of Python."
        ) from None


def _defaults(make: Callable[..., Any]) -> dict[str, Any]:
    """Return the arguments of a function or class that can be parameters, with their defaults.

    A whole number is a default of type float if the annotation is `float`.
    """
    defaults = {}
    for name, argument in _signature(make).items():
        value = argument.default
        if type(value) is int and argument.annotation in (float, "float"):
            value = float(value)
        simple = type(value) in _SIMPLE and (type(value) is not float or math.isfinite(value))
        if simple and name not in _RANDOM and not name.startswith("_"):
            defaults[name] = value
    return defaults
