"""What a tracker may show of a frame, for those who want to see what it sees."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image


@runtime_checkable
class Mapper(Protocol):
    """What a tracker offers besides, where it weighs pixels."""

    def maps(self, image: Image) -> Mapping[str, NDArray[Any]]:
        """What each pixel of the frame that `update` was just given weighs, by name.

        Shape (height, width), in [0, 1]; 1 is most like the target. Asked only where arrays are
        kept, and on nobody's clock; what the tracker says afterwards must be the same without.
        """
        ...
