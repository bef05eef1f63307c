"""Mean shift that starts where a Kalman filter predicts the target (Comaniciu & Ramesh 2000)."""

from collections.abc import Mapping
from math import inf, log, sqrt

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.kalman import ConstantVelocity
from trackmark.trackers.base.parameters import fraction, positive
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms.mean_shift import Location, MeanShiftParameters, TargetEllipse

__all__ = ["MeanShiftKalman"]


class MeanShiftKalmanParameters(MeanShiftParameters):
    """Parameters of `MeanShiftKalman`."""

    acceleration_noise: float = positive(
        5.0, "standard deviation of the target's acceleration [pixels/frame²]"
    )
    least_coefficient: float = fraction(
        0.5, "where the best place is less similar than this, the prediction stands [coefficient]"
    )


class MeanShiftKalman(SharingTracker):
    """Mean shift that starts where a Kalman filter predicts the target.

    Mean shift is that of `mean-shift`, with the same parameters. Two filters, one an axis, of
    position and velocity under white acceleration predict where it starts; where it comes to
    rest is their measurement. The measurement's uncertainty comes from the surface of the
    Bhattacharyya coefficient (Comaniciu, Ramesh & Meer 2003, section on Kalman prediction): the
    standard deviation of the scaled Gaussian through the coefficients at that place and half
    a target to either side. A similar object beside the target, or one before it, flattens the
    surface, and the prediction prevails. The box is around the filters' position.

    Ours are: the filters begin at the box with a velocity of 0 ± half a target a frame; a
    surface without a peak at that place measures nothing; mean shift starts inside the image
    also where the prediction has left it. `recommended` doesn't believe a place whose
    coefficient is below `least_coefficient`: neither position nor size follow it, and the
    target counts as not visible. `as-written` believes every place to its uncertainty. The
    acceleration is that of the 2003 paper's hand sequence.

    Details: those of `mean-shift`, `measured_x` and `measured_y` (where mean shift came to rest,
    in pixels), and `gain_x` and `gain_y` (the share of the way there that the box went, in
    [0, 1]).
    """

    paper = (
        "D. Comaniciu & V. Ramesh, Mean shift and optimal prediction for efficient object "
        "tracking, ICIP 2000; D. Comaniciu, V. Ramesh & P. Meer, Kernel-based object tracking, "
        "IEEE PAMI 25(5), 2003"
    )
    presets = {"as-written": {"stop_distance": 1.0, "least_coefficient": 0.0}, "recommended": {}}
    Parameters = MeanShiftKalmanParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`, and `TargetEllipse` for what is refused."""
        self._target = TargetEllipse("mean-shift-kalman", self.parameters, frame, box)
        half_axes = box[2:] / 2
        self._motion = ConstantVelocity(
            box[:2] + half_axes, half_axes, self.parameters.acceleration_noise
        )

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        target, motion = self._target, self._motion
        motion.predict()
        height, width = frame.image.shape[:2]
        found = target.locate(frame, *np.clip(motion.position, 0.0, [width, height]).tolist())
        visible = found.coefficient > 0 and (found.coefficient >= self.parameters.least_coefficient)
        gains = np.zeros(2)
        if visible:
            gains = motion.correct(np.array(found[:2]), self._deviations(frame, found))
            target.take_size(found)
        return Estimate(
            target.box(*motion.position.tolist()),
            visible=visible,
            confidence=found.coefficient,
            details=target.details(found)
            | {
                "measured_x": found.x,
                "measured_y": found.y,
                "gain_x": float(gains[0]),
                "gain_y": float(gains[1]),
            },
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """See `Mapper.maps`."""
        return {"target's colours": self._target.map(image)}

    def _deviations(self, frame: SharedFrame, found: Location) -> NDArray[np.float64]:
        """How uncertain the place is along x and y, in pixels."""
        left, right, above, below = self._target.coefficients_beside(frame, found).tolist()
        peak = found.coefficient
        return np.array(
            [
                _deviation(left, peak, right, found.half_width),
                _deviation(above, peak, below, found.half_height),
            ]
        )


def _deviation(before: float, peak: float, after: float, distance: float) -> float:
    """Return the standard deviation of the scaled Gaussian through three equally distant points."""
    ratio = before * after / peak**2
    if ratio >= 1:  # no peak
        return inf
    return distance / sqrt(-log(ratio)) if ratio > 0 else 0.0
