"""Mean shift on a kernel-weighted colour histogram (Comaniciu, Ramesh & Meer)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms.mean_shift import MeanShiftParameters, TargetEllipse

__all__ = ["MeanShift"]


class MeanShift(SharingTracker):
    """Mean shift on a kernel-weighted colour histogram.

    The target model q is the joint colour histogram of the ellipse inscribed in the first box;
    a pixel weighs 1 - (dx/hx)² - (dy/hy)² by its distance from the centre, nothing on the rim.
    In each frame the ellipse starts where it was and goes to the mean of its pixels, of which
    each weighs √(q/p) of its bin, p being the ellipse's histogram, until a step is shorter than
    ε or there were `max_iterations`. A step that lowers the Bhattacharyya coefficient ρ of p
    and q is halved. This is done with the size h as it is, and 10 % smaller and larger; the
    place with the largest ρ is the target's, and of its size h takes over the share γ.

    The paper has 16 bins a channel. Here it has 8, so that it compares the same histograms as
    the particle filter of Nummiaro et al. 2003, whose baseline it is; `bins=16` is the paper's.
    `as-written` stops at steps within a pixel; `recommended` at a tenth of it, for steps
    become short well before the ellipse is where it tends to.

    The weights of the kernel are whole numbers of 1/65536. Of equal coefficients the size as
    it is wins, so that a target of one colour keeps its size. What is outside the image
    doesn't count; sides stay between 3 pixels and the image's. Where no pixel of the ellipse has
    a colour of the model it stays, and the target counts as not visible.

    Details: `coefficient` (ρ, in [0, 1], which is the confidence too), `iterations` (of the
    size that was the best), `half_width` and `half_height` (of the box, in pixels).
    """

    paper = (
        "D. Comaniciu, V. Ramesh & P. Meer, Real-time tracking of non-rigid objects using mean "
        "shift, CVPR 2000; Kernel-based object tracking, IEEE PAMI 25(5), 2003"
    )
    presets = {"as-written": {"stop_distance": 1.0}, "recommended": {}}
    Parameters = MeanShiftParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`, and `TargetEllipse` for what is refused."""
        self._target = TargetEllipse("mean-shift", self.parameters, frame, box)
        self._x, self._y = float(box[0] + box[2] / 2), float(box[1] + box[3] / 2)

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        target = self._target
        found = target.locate(frame, self._x, self._y)
        self._x, self._y = found.x, found.y
        target.take_size(found)
        return Estimate(
            target.box(found.x, found.y),
            visible=found.coefficient > 0,
            confidence=found.coefficient,
            details=target.details(found),
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """See `Mapper.maps`."""
        return {"target's colours": self._target.map(image)}
