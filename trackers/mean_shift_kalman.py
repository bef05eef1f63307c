"""Mean shift that starts where a Kalman filter predicts the target (Comaniciu & Ramesh 2000)."""

from collections.abc import Mapping
from math import inf, log, sqrt

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.kalman import ConstantVelocity
from trackmark.trackers.base.parameters import chosen, fraction, positive
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms.mean_shift import (
    CHOICES,
    RECALLED,
    Location,
    MeanShiftParameters,
    TargetEllipse,
)

__all__ = ["MeanShiftKalman"]


class MeanShiftKalmanParameters(MeanShiftParameters):
    """Parameters of `MeanShiftKalman`."""

    acceleration_noise: float = positive(
        5.0,
        "standard deviation of the target's acceleration [pixels/frame²]",
        origin=chosen(f"{RECALLED} hand sequence"),
    )
    least_coefficient: float = fraction(
        0.0,
        "if the coefficient of the result is lower, the target is not visible, and the "
        "prediction is used [coefficient]",
        origin=chosen("the papers use every result of mean shift"),
    )


class MeanShiftKalman(SharingTracker):
    """Mean shift that starts where a Kalman filter predicts the target.

    Mean shift and its parameters are those of `mean-shift`. It starts at the position that a Kalman
    filter per axis (position and velocity, white acceleration) predicts. Its result is the
    measurement of the filters. For the measurement's standard deviation, a scaled Gaussian is
    fitted to three Bhattacharyya coefficients: at the result, and half the target's size to both
    sides (Comaniciu, Ramesh & Meer 2003). A similar object near the
    target, or an occlusion, flattens this surface, so that the prediction prevails. The box is
    centred at the filtered position.

    Decisions that the papers leave open: the initial velocity is 0 with a standard deviation of
    half the target's size per frame. A surface without a peak counts as a measurement of infinite
    variance. The start of mean shift is clipped to the image. `recommended` ignores results with a
    coefficient below `least_coefficient`: they correct neither position nor size, and the target is
    not visible. `as-written` uses every result. The default acceleration is the value for the hand
    sequence of the 2003 paper.

    Details: those of `mean-shift`, `measured_x` and `measured_y` (result of mean shift [pixels]),
    and `gain_x` and `gain_y` (Kalman gains in [0, 1]).
    """

    paper = (
        "D. Comaniciu & V. Ramesh, Mean shift and optimal prediction for efficient object "
        "tracking, ICIP 2000; D. Comaniciu, V. Ramesh & P. Meer, Kernel-based object tracking, "
        "IEEE PAMI 25(5), 2003"
    )
    presets = {
        "as-written": {},
        "recommended": {"stop_distance": 0.1, "least_coefficient": 0.5},
    }
    choices = {
        **CHOICES,
        "deviation of the initial velocity": (
            "half the target's size per frame",
            "the first velocity is not known",
        ),
        "surface of coefficients without a peak": (
            "infinite variance",
            "the fitted Gaussian has no deviation",
        ),
        "start of mean shift": (
            "the prediction, clipped to the image",
            "outside the image, an ellipse has no pixels",
        ),
    }
    Parameters = MeanShiftKalmanParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError as `TargetEllipse` does."""
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
        location = target.locate(frame, *np.clip(motion.position, 0.0, [width, height]).tolist())
        visible = location.coefficient > 0 and (
            location.coefficient >= self.parameters.least_coefficient
        )
        gains = np.zeros(2)
        if visible:
            gains = motion.correct(np.array(location[:2]), self._deviations(frame, location))
            target.adapt_size(location)
        return Estimate(
            target.box(*motion.position.tolist()),
            visible=visible,
            confidence=location.coefficient,
            details=target.details(location)
            | {
                "measured_x": location.x,
                "measured_y": location.y,
                "gain_x": float(gains[0]),
                "gain_y": float(gains[1]),
            },
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """See `WeightMapTracker.maps`."""
        return {"target's colours": self._target.map(image)}

    def _deviations(self, frame: SharedFrame, location: Location) -> NDArray[np.float64]:
        """Return the standard deviations (2,) of the measured position [pixels]."""
        left, right, above, below = self._target.neighbour_coefficients(frame, location).tolist()
        peak = location.coefficient
        return np.array(
            [
                _deviation(left, peak, right, location.half_width),
                _deviation(above, peak, below, location.half_height),
            ]
        )


def _deviation(before: float, peak: float, after: float, distance: float) -> float:
    """Return the standard deviation of the scaled Gaussian through three equally spaced points."""
    ratio = before * after / peak**2
    if ratio >= 1:  # the surface has no peak
        return inf
    return distance / sqrt(-log(ratio)) if ratio > 0 else 0.0
