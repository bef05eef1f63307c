"""Adapter of plain trackers: classes with `init(image, box)` and `update(image)`, without imports.

`to_plugin` turns such a class into a `TrackerPlugin`; `plain_class.py` has the rules.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar, TypeVar

import numpy as np
from pydantic import create_model

from trackmark.trackers.base import plain_class
from trackmark.trackers.base.call_clock import device_name
from trackmark.trackers.base.estimate_check import (
    MalformedEstimateError,
    read_box,
    read_estimate,
    value_text,
)
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters, TrackerError, unknown_name_error

_Plugin = TypeVar("_Plugin", bound=TrackerPlugin)


class AdaptedTracker(TrackerPlugin):
    """Plugin that calls a tracker without a base class, which returns values of several forms.

    Attributes
    ----------
    images : str
        Channels of the images that the tracker gets; see `convert`.
    """

    images: str = plain_class.IMAGES[0]
    _last_box: Box

    @classmethod
    def with_images(cls, images: Any, owner: str) -> "type[AdaptedTracker]":
        """Return the class with other `images`; raise `TrackerError` for an unknown value.

        `owner`: name of the tracker in messages.
        """
        if images not in plain_class.IMAGES:
            raise unknown_name_error(f"value of images of {owner}", str(images), plain_class.IMAGES)
        same = {"images": images, "__doc__": cls.__doc__, "__module__": cls.__module__}
        return type(cls.__name__, (cls,), same)

    def convert(self, image: Image) -> Image:
        """Return a BGR image as the tracker gets it.

        It is read-only if `image` is: `bgr` or `rgb` of shape (height, width, 3), or `grey` of
        shape (height, width), by the weights of ITU-R BT.601, as in OpenCV.
        """
        if self.images == plain_class.IMAGES[0]:
            return image
        import cv2  # here: lists of trackers do not need it

        is_grey = self.images == "grey"
        converted = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY if is_grey else cv2.COLOR_BGR2RGB)
        converted.flags.writeable = image.flags.writeable
        return np.asarray(converted)

    def estimate(self, fields: Mapping[str, Any]) -> Estimate:
        """Return the result of `read_estimate` as an estimate; without a box, with the last one."""
        if fields["box"] is not None:
            self._last_box = np.array(fields["box"])
        return Estimate(**{**fields, "box": self._last_box})


class PlainTracker(AdaptedTracker):
    """Plugin that calls a plain tracker; see `to_plugin`.

    `make` creates the plain tracker. The harness measures and checks the calls of `plain` itself:
    `update` would do both twice.

    Attributes
    ----------
    plain : object
        The plain tracker. Its method `update` gets a converted image.
    plain_init : callable
        Its method `init`, with the arguments converted image, box and mask.
    """

    make: ClassVar[Callable[..., Any]]

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        values = parameters.model_dump()
        tracker = plain_class.create(type(self).make, values, seed_number(seed), lambda: seed)
        try:
            plain_class.check_methods(tracker)
            self.plain_init = plain_class.adapt_init(tracker.init)
            if not isinstance(type(self).make, type):  # a function: the object has the attribute
                self.images = plain_class.declared_images(type(tracker))
        except ValueError as error:
            raise TrackerError(f"tracker {type(self).__name__!r}: {error}") from None
        self.plain = tracker

    @property
    def device(self) -> str:
        """Name of the accelerator that the plain tracker uses; empty if unknown."""
        return device_name(self.plain)

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        self._last_box = np.array(box)
        self.plain_init(self.convert(image), box, mask)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        returned = self.plain.update(self.convert(image))
        try:
            estimate = self.estimate(read_estimate(returned, image.shape))
        except MalformedEstimateError as error:
            raise TrackerError(f"{error}.") from None
        if isinstance(returned, Estimate):
            return replace(estimate, arrays=returned.arrays, revised=returned.revised)
        return estimate


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
    name = name or getattr(make, "__name__", "tracker")
    try:
        description = plain_class.describe(make)
    except ValueError as error:
        raise TrackerError(f"tracker {name!r}: {error}") from None
    return create_plugin(
        PlainTracker,
        name,
        description,
        make=staticmethod(make),
        __module__=make.__module__,
        __qualname__=getattr(make, "__qualname__", description["class"]),
    )


def read_answer(tracker: Any, returned: Any, shape: tuple[int, ...]) -> dict[str, Any]:
    """Return the fields of the estimate that `update` of a tracker returned; see `read_estimate`.

    `tracker` is a plugin. If it is a `PlainTracker`, `returned` is what its `plain` returned. Other
    plugins must return an `Estimate`, which has a box unless the target is not visible.

    Raises `MalformedEstimateError` for any other value.
    """
    if not isinstance(tracker, PlainTracker):
        if not isinstance(returned, Estimate):
            raise MalformedEstimateError(
                f"update returned {value_text(returned)}. Expected: an Estimate"
            )
        if returned.box is None and returned.visible:
            read_box(returned.box)  # raises the error
    return read_estimate(returned, shape)


def create_plugin(
    base: type[_Plugin], owner: str, description: Mapping[str, Any], **attributes: Any
) -> type[_Plugin]:
    """Return a class that derives from `base`, with the properties of a tracker.

    `description` is the result of `plain_class.describe`, `owner` the tracker in messages.

    Raises `TrackerError` if the source of random numbers or the name of a parameter is invalid.
    """
    try:
        randomness = Randomness(description["randomness"])
    except ValueError:
        raise TrackerError(
            f"tracker {owner!r}: the randomness is {description['randomness']!r}. Expected one of: "
            f"{', '.join(Randomness)}."
        ) from None
    for name in description["parameters"]:
        if name in ("checked", "images") or (
            name.startswith("model_") and hasattr(Parameters, name)
        ):
            raise TrackerError(
                f"tracker {owner!r}: the argument {name!r} has a reserved name. Choose another one."
            )
    fields: Any = {name: (type(value), value) for name, value in description["parameters"].items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a name such as `copy` hides a method
        parameters = create_model("PlainParameters", __base__=Parameters, **fields)
    attributes |= {
        "__doc__": description["doc"],
        "name": description["name"],
        "Parameters": parameters,
        "randomness": randomness,
        **({"images": description["images"]} if "images" in description else {}),
    }
    return type(description["class"], (base,), attributes)


def seed_number(seed: np.random.SeedSequence) -> int:
    """Return the argument `seed` of a plain tracker: an int in [0, 2³¹), valid in all libraries."""
    return int(seed.generate_state(1)[0]) >> 1
