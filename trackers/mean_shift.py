"""Mean shift on a kernel-weighted colour histogram (Comaniciu, Ramesh & Meer)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms.mean_shift import CHOICES, MeanShiftParameters, TargetEllipse

__all__ = ["MeanShift"]


class MeanShift(SharingTracker):
    """Mean shift on a kernel-weighted colour histogram.

    The target model q is the joint colour histogram of the ellipse inscribed in the init box. The
    kernel weight of a pixel is 1 - (dx/hx)² - (dy/hy)², 0 on the rim. In each frame the ellipse
    starts at its last position and moves to the mean of its pixels, weighted by √(q/p) of their
    bins, where p is the ellipse's histogram. It stops after a step below ε or after
    `max_iterations`. A step that lowers the Bhattacharyya coefficient ρ of p and q is halved. The
    search uses the current size h and sizes 10 % smaller and larger. The result of largest ρ is the
    estimate; h becomes γ times its size plus (1 - γ) h.

    The paper uses 16 bins per channel. The default is 8, as in the particle filter of Nummiaro et
    al. 2003, whose baseline this tracker is; `bins=16` is the paper's value. `as-written` stops
    after a step below a pixel. `recommended` stops after a step below 0.1 pixels, because steps
    become short well before convergence.

    Kernel weights are multiples of 1/65536. If coefficients are equal, the current size is kept, so
    that a target of one colour keeps its size. Pixels outside the image do not count. Sides are
    between 3 pixels and the image's size. If no pixel of the ellipse has a colour of the model, the
    ellipse is not moved and the target is not visible.

    Details: `coefficient` (ρ in [0, 1], also the confidence), `iterations` (of the best size),
    `half_width` and `half_height` (of the box [pixels]).
    """

    paper = (
        "D. Comaniciu, V. Ramesh & P. Meer, Real-time tracking of non-rigid objects using mean "
        "shift, CVPR 2000; Kernel-based object tracking, IEEE PAMI 25(5), 2003"
    )
    presets = {"as-written": {}, "recommended": {"stop_distance": 0.1}}
    choices = CHOICES
    Parameters = MeanShiftParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError as `TargetEllipse` does."""
        self._target = TargetEllipse("mean-shift", self.parameters, frame, box)
        self._x, self._y = float(box[0] + box[2] / 2), float(box[1] + box[3] / 2)

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        target = self._target
        location = target.locate(frame, self._x, self._y)
        self._x, self._y = location.x, location.y
        target.adapt_size(location)
        return Estimate(
            target.box(location.x, location.y),
            visible=location.coefficient > 0,
            confidence=location.coefficient,
            details=target.details(location),
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """See `WeightMapTracker.maps`."""
        return {"target's colours": self._target.map(image)}
