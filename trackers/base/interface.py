"""The tracker's side of the contract: image in, estimate out."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.parameters import Parameters, TrackerError

Image: TypeAlias = NDArray[np.uint8]
"""Shape (height, width, 3), BGR, contiguous; read-only to a tracker."""

Box: TypeAlias = NDArray[np.float64]
"""`[x, y, width, height]` in pixels; pixel column i spans [i, i + 1)."""

Mask: TypeAlias = NDArray[np.bool_]
"""Shape (height, width); true on the target."""


def four_numbers(box: Box) -> Box:
    """The box as it is taken; raises TrackerError where it is not finite with a positive size."""
    try:
        numbers = np.asarray(box, np.float64)
    except (TypeError, ValueError):  # words, or rows of unequal lengths
        numbers = np.empty(0)
    if numbers.shape != (4,) or not np.isfinite(numbers).all() or not (numbers[2:] > 0).all():
        raise TrackerError(
            "a box is [x, y, width, height], four finite numbers, width and height positive, "
            f"not {' '.join(str(box).split())[:80]}."
        )
    return numbers


class NotInitialisedError(TrackerError, AttributeError):
    """A tracker was asked for something that its `init` has to set first."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a tracker says of one frame.

    Attributes
    ----------
    box : ndarray of float64, shape (4,)
        Best guess of the target's box, in pixels, also when it is not visible.
    visible : bool
        Whether the tracker believes that the target can be seen.
    confidence : float
        The tracker's own likelihood of its estimate, in [0, 1]; NaN where it has none.
    mask : ndarray of bool, shape (height, width), or None
        The target's pixels, where the tracker segments.
    details : mapping of str to float
        Numbers that a figure plots, one column each in the results.
    arrays : mapping of str to ndarray
        Larger things (particles, a contour, a map); kept only when asked for.
    revised : mapping of int to Box, or None
        Boxes of earlier frames that the tracker corrects now, by frame number: 0 is the first
        frame that it was shown, by `watch` or `init`. What was said online stays as it was.
    """

    box: Box
    visible: bool = True
    confidence: float = nan
    mask: Mask | None = None
    details: Mapping[str, float] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    revised: Mapping[int, Box] | None = None


@runtime_checkable
class Tracker(Protocol):
    """Follows one target through one sequence."""

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """Take the target's box in the first frame; makes the whole state afresh."""
        ...

    def update(self, image: Image) -> Estimate:
        """Find the target in the next frame. This call alone is what timing runs time."""
        ...


@runtime_checkable
class Watcher(Protocol):
    """What a tracker offers besides, where it can use frames without the target."""

    def watch(self, image: Image) -> None:
        """See a frame before the target is there; all come in order, and then `init`."""
        ...


@runtime_checkable
class Finisher(Protocol):
    """What a tracker offers besides, where the sequence's end settles what was left open."""

    def finish(self) -> Mapping[int, Box]:
        """Return boxes of earlier frames (see `Estimate.revised`), at most once, after the last."""
        ...


@runtime_checkable
class Mapper(Protocol):
    """What a tracker offers besides, where it weighs pixels."""

    def maps(self, image: Image) -> Mapping[str, NDArray[Any]]:
        """What each pixel of the frame that `update` was just given weighs, by name.

        Shape (height, width), in [0, 1]; 1 is most like the target. Manifest only where arrays are
        kept, and on nobody's clock; what the tracker says afterwards must be the same without.
        """
        ...


class Randomness(StrEnum):
    """Where a tracker's random numbers come from."""

    NONE = "none"
    """Deterministic: one run a sequence says everything."""

    GENERATOR = "generator"
    """Its own `numpy.random.Generator`, made from the seed."""

    PROCESS = "process"
    """State of the whole process: such a tracker runs in a process of its own."""


class TrackerPlugin(ABC):
    """What a file in `trackers/` defines: a tracker with its parameters and presets.

    The file's `__all__` names exactly one such class. The harness makes a fresh instance
    for every run; `init` must leave nothing behind of an earlier sequence all the same.

    Attributes
    ----------
    name : str
        What a tracker in a file of its own is called, instead of `file.py:ClassName`.
    paper : str
        Where the method comes from, as a reader would cite it.
    randomness : Randomness
        `NONE` trackers run once a sequence, the others once a repetition.
    presets : mapping of str to mapping
        Parameter values by preset name. `recommended` always exists, empty where a tracker
        defines none. The tracker's name alone means it, or the one that a class attribute
        `default_preset` names.
    Parameters : type
        The tracker's parameters, frozen at creation.

    Parameters
    ----------
    parameters : Parameters
        An instance of the class's own `Parameters`.
    seed : numpy.random.SeedSequence
        All that the tracker's random numbers may depend on.
    """

    name: ClassVar[str] = ""
    paper: ClassVar[str] = ""
    randomness: ClassVar[Randomness] = Randomness.NONE
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    Parameters: ClassVar[type[Parameters]] = Parameters

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        self.parameters = parameters
        self.seed = seed

    if not TYPE_CHECKING:  # to which every name would be an attribute

        def __getattr__(self, name: str) -> Any:
            """Say why an attribute is missing: `update` came before `init`, most likely."""
            raise NotInitialisedError(
                f"{type(self).__name__} has no {name!r}: `init`, which must come before `update`, "
                "has not set it."
            )

    @abstractmethod
    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""

    @abstractmethod
    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
