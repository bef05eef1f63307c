"""Tracker interface: what a tracker receives (images, an init box) and returns (estimates)."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan
from typing import Any, ClassVar, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.parameters import Parameters, TrackerError

Image: TypeAlias = NDArray[np.uint8]
"""Contiguous BGR image of shape (height, width, 3); trackers must not modify it."""

Box: TypeAlias = NDArray[np.float64]
"""`[x, y, width, height]` in pixels; pixel column i spans [i, i + 1)."""

Mask: TypeAlias = NDArray[np.bool_]
"""Shape (height, width); true on the target."""


def check_box(box: Box) -> Box:
    """Return a box as float64 (4,); raise TrackerError unless it is finite with a positive size."""
    try:
        values = np.asarray(box, np.float64)
    except (TypeError, ValueError):  # text, or rows of unequal lengths
        values = np.empty(0)
    if values.shape != (4,) or not np.isfinite(values).all() or not (values[2:] > 0).all():
        raise TrackerError(
            f"{' '.join(str(box).split())[:80]} is not a valid box. Expected: four finite numbers "
            "[x, y, width, height], with width and height above 0."
        )
    return values


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate of one frame, returned by `Tracker.update`.

    Attributes
    ----------
    box : ndarray of float64, shape (4,)
        Estimated bounding box `[x, y, width, height]` [pixels], also if the target is not visible.
    visible : bool
        True if the tracker considers the target visible.
    confidence : float
        Confidence of the tracker in [0, 1]; NaN if it has none.
    mask : ndarray of bool, shape (height, width), or None
        True on pixels of the target; None if the tracker does not segment.
    details : mapping of str to float
        Scalars of this frame; each becomes a column of the results and a curve in figures.
    arrays : mapping of str to ndarray
        Arrays such as particles, contours and maps; stored only on request.
    revised : mapping of int to Box, or None
        Corrected boxes of earlier frames by frame number. Frame 0 is the first one that was passed
        to `watch` or `init`. The boxes that `update` returned for these frames stay unchanged.
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
    """Tracker of one target in one sequence."""

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """Initialise the state from the first frame, the target's box and its optional mask."""
        ...

    def update(self, image: Image) -> Estimate:
        """Estimate the target in the next frame. Timing runs measure this call only."""
        ...


@runtime_checkable
class EarlyFrameTracker(Protocol):
    """Optional method of trackers that use the frames in which the target has not appeared yet."""

    def watch(self, image: Image) -> None:
        """Process a frame without the target; called in frame order, before `init`."""
        ...


@runtime_checkable
class RevisingTracker(Protocol):
    """Optional method of trackers that revise earlier boxes at the end of the sequence."""

    def finish(self) -> Mapping[int, Box]:
        """Return corrected boxes (see `Estimate.revised`); called once, after the last frame."""
        ...


@runtime_checkable
class WeightMapTracker(Protocol):
    """Optional method of trackers that compute a weight per pixel."""

    def maps(self, image: Image) -> Mapping[str, NDArray[Any]]:
        """Return weight maps of the frame that was just passed to `update`, by name.

        Each map has shape (height, width) and values in [0, 1]; 1 is most similar to the target.
        The method is called only if arrays are stored, and its time is not measured. It must not
        change later estimates.
        """
        ...


class Randomness(StrEnum):
    """Source of a tracker's random values."""

    NONE = "none"
    """No random numbers: one run per sequence suffices."""

    GENERATOR = "generator"
    """A `numpy.random.Generator` of the tracker, created from its seed."""

    PROCESS = "process"
    """A generator of the whole process: such a tracker runs in a separate process."""


class TrackerPlugin(ABC):
    """Base class of trackers: the class that a tracker file defines.

    The file's `__all__` contains exactly one such class. The harness creates a new instance for
    every run. `init` must nevertheless discard the state of an earlier sequence.

    Attributes
    ----------
    name : str
        Name of a tracker outside the package; by default `file.py:ClassName`.
    paper : str
        Citation of the method.
    randomness : Randomness
        Source of random values. Trackers with `NONE` run once per sequence, others once per
        repetition.
    presets : mapping of str to mapping
        Parameter values by preset name. A tracker that does not define `recommended` gets it
        without values.
    default_preset : str
        Preset that is used if none is requested.
    choices : mapping of str to (value, reason)
        Constants that decide results but are no parameters, by their meaning. The value refers to
        the constant of the code.
    Parameters : type
        Class of the tracker's parameters.

    Parameters
    ----------
    parameters : Parameters
        Instance of the class attribute `Parameters`.
    seed : numpy.random.SeedSequence
        Only source of the tracker's random values.
    """

    name: ClassVar[str] = ""
    paper: ClassVar[str] = ""
    randomness: ClassVar[Randomness] = Randomness.NONE
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    default_preset: ClassVar[str] = "recommended"
    choices: ClassVar[Mapping[str, tuple[Any, str]]] = {}
    Parameters: ClassVar[type[Parameters]] = Parameters

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        self.parameters = parameters
        self.seed = seed

    @abstractmethod
    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""

    @abstractmethod
    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
