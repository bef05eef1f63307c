"""Work on one frame that several trackers want, done once."""

from abc import abstractmethod
from collections.abc import Callable, Hashable
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Image,
    Mask,
    TrackerPlugin,
    four_numbers,
)
from trackmark.trackers.base.parameters import TrackerError

P = ParamSpec("P")
R = TypeVar("R")


class SharedFrame:
    """A frame and what has been computed of it so far; lives for one frame.

    The image, uint8 of shape (height, width, 3), is handed on read-only; raises TrackerError for
    another type or shape. `sharers`, at least 1, is how many trackers are shown it. What pays only
    for many can be made when they are many; the estimates must not depend on it.
    """

    __slots__ = ("_computed", "image", "sharers")

    def __init__(self, image: Image, sharers: int = 1) -> None:
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
            raise TrackerError(
                f"an image is uint8 of shape (height, width, 3), BGR, not {image.dtype} of shape "
                f"{image.shape}; cv2.cvtColor converts."
            )
        locked = image.view()
        locked.flags.writeable = False
        # Handed on without its owner: a flag alone, a tracker could set back.
        self.image: Image = np.from_dlpack(locked)  # type: ignore[assignment]  # of any dtype
        self.sharers = sharers
        self._computed: dict[Hashable, Any] = {}

    def compute(
        self, function: Callable[Concatenate[Image, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Give `function(image, ...)`: computed by the first that asks, kept for the others.

        `function` must depend on its arguments alone; whoever takes the result must not
        change what another would see in it.
        """
        key = (function, args, tuple(sorted(kwargs.items())))
        if key not in self._computed:
            self._computed[key] = function(self.image, *args, **kwargs)
        return self._computed[key]  # type: ignore[no-any-return]  # kept under its function's key


class SharingTracker(TrackerPlugin):
    """A tracker that can share work on a frame with others in lock step.

    It implements `init_shared` and `update_shared`; the plain calls go through the same
    code with a frame of its own, so that both give the same boxes to the bit.
    """

    @abstractmethod
    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; `frame` may hold work that others did."""

    @abstractmethod
    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; `frame` may hold work that others did."""

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError for what is no box."""
        self.init_shared(SharedFrame(image), four_numbers(box), mask)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        return self.update_shared(SharedFrame(image))
