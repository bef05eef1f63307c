"""Computations on a frame that several trackers share."""

from abc import abstractmethod
from collections.abc import Callable, Hashable
from time import thread_time
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, TrackerPlugin, check_box
from trackmark.trackers.base.parameters import TrackerError

P = ParamSpec("P")
R = TypeVar("R")


class SharedFrame:
    """Image of one frame with a cache of results that were computed from it.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR image; trackers receive a read-only view. Another type or shape raises TrackerError.
    sharers : int
        Number of trackers that process the frame, at least 1. A tracker may use it to choose the
        faster of two computations with equal results.

    Attributes
    ----------
    saved_seconds : float
        Time of the computations whose cached results were returned so far [s]. The time of a
        tracker includes what it would have computed alone.
    """

    __slots__ = ("_computed", "image", "saved_seconds", "sharers")

    def __init__(self, image: Image, sharers: int = 1) -> None:
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
            raise TrackerError(
                f"the image is {image.dtype} of shape {image.shape}. Expected: BGR, uint8, of "
                "shape (height, width, 3). Convert it with cv2.cvtColor."
            )
        locked = image.view()
        locked.flags.writeable = False
        # The view has no base array, so a tracker cannot make it writeable again.
        self.image: Image = np.from_dlpack(locked)  # type: ignore[assignment]  # of any dtype
        self.sharers = sharers
        self.saved_seconds = 0.0
        self._computed: dict[Hashable, tuple[Any, float]] = {}  # result and CPU time [s]

    def compute(
        self, function: Callable[Concatenate[Image, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Return `function(image, ...)`, computed by the first call and cached for later ones.

        `function` must depend only on its arguments. Callers must not modify the result.
        """
        key = (function, args, tuple(sorted(kwargs.items())))
        if key in self._computed:
            result, seconds = self._computed[key]
            self.saved_seconds += seconds
        else:
            started = thread_time()
            result = function(self.image, *args, **kwargs)
            self._computed[key] = result, thread_time() - started
        return result  # type: ignore[no-any-return]  # kept under its function's key


class SharingTracker(TrackerPlugin):
    """Base class of trackers that share computations with others on the same frame.

    A subclass implements `init_shared` and `update_shared`. `init` and `update` call them with a
    new `SharedFrame`. Calls with an image and with a shared frame give identical boxes.
    """

    @abstractmethod
    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; `frame` may contain cached results of other trackers."""

    @abstractmethod
    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; `frame` may contain cached results of other trackers."""

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if `box` is not a valid box."""
        self.init_shared(SharedFrame(image), check_box(box), mask)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        return self.update_shared(SharedFrame(image))
