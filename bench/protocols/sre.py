"""From twelve first boxes that are a little wrong: spatial robustness (SRE).

The first box is moved by a tenth of its width or height to the left, to the right, up, down; one
of its corners is drawn outwards by a tenth of both, the opposite one staying; and it is scaled
about its centre by 0.8, 0.9, 1.1 and 1.2. Nothing is rounded, and a box may reach beyond the
image, as a true one may; a tracker is given no mask. Each is a segment with a tracker, and random
numbers, of its own. It is scored from the frame after on, against the truth as it is; a score is
the mean over segments. Wu, Lim and Yang, "Online object tracking: a benchmark", CVPR 2013.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.bench.protocols import Protocol, Segment


class SpatialRobustness(Protocol):
    """Knobs of how wrong the first boxes are."""

    segmented: ClassVar[bool] = True

    shift: float = Field(0.1, gt=0, lt=1, description="of moved boxes and corners [sizes]")
    scale: float = Field(0.1, gt=0, lt=0.5, description="steps of the scale, two down and two up")

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `Protocol.segments`."""
        d = self.shift
        sides = [(-d, 0.0), (d, 0.0), (0.0, -d), (0.0, d)]
        corners = [(-d, -d, d, d), (0.0, -d, d, d), (-d, 0.0, d, d), (0.0, 0.0, d, d)]
        grown = [factor * self.scale for factor in (-2, -1, 1, 2)]
        moved = [(x, y, 0.0, 0.0) for x, y in sides]
        moved += corners
        moved += [(-g / 2, -g / 2, g, g) for g in grown]
        return [Segment(perturbation=each) for each in moved]


PROTOCOL = SpatialRobustness
