"""Improved CamShift of Wang & Tang 2010: mean shift on colour and motion, without particles."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.parameters import choice, chosen, integer, nonnegative, printed
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.maps.back_projection import adapted_window, window_size
from trackmark.trackers.maps.joint_map import CHOICES, ColourMotionModel, ColourMotionParameters

__all__ = ["CamShiftImproved"]


class CamShiftImprovedParameters(ColourMotionParameters):
    """Parameters of `CamShiftImproved`."""

    window: Literal["fixed", "adaptive"] = choice(
        "fixed",
        "fixed: the window keeps the size of the init box; adaptive: Bradski's rule sets it once "
        "per frame",
        origin=chosen(
            "section 2.2 lists no size step; Bradski's rule is the other reading of the name "
            "CamShift"
        ),
    )
    stop_distance: float = nonnegative(
        2.0,
        "ε: mean shift stops after a step shorter than this [pixels]",
        origin=printed("section 2.2: ε = 2"),
    )
    max_iterations: int = integer(
        11,
        "n₀ + 1: maximum number of mean shift steps per frame [count]",
        origin=printed("section 2.2, step 3: stop if n₁ > n₀ = 10, after n₁ was increased"),
    )


class CamShiftImproved(SharingTracker):
    """Improved CamShift of section 2.2: mean shift on colour and motion, without particles.

    Weights are defined as in `wang2010`: I_c for moving pixels, (1 - β) I_c for others. In each
    frame the window moves to the centroid of its weights until a step is below ε, or n₁ > n₀, at
    most n₀ + 1 = 11 times (equations 6 and 7).

    The paper names CamShift but describes only the centroid. So `as-written` and `recommended` keep
    the window's size; `window=adaptive` uses Bradski's rule as in `camshift`. The camera must not
    move; see `wang2010`.

    Details: `iterations`, `similarity` (M / M₀, the mean weight in the window, also the
    confidence), `moving`, `moving_inside` and `changing` as in `wang2010`.
    """

    paper = (
        "X. Wang, Z. Tang, An improved camshift-based particle filter algorithm for real-time "
        "target tracking, Journal of Image and Graphics 15(10), 2010 (in Chinese), section 2.2"
    )
    presets = {"as-written": {}, "recommended": {}}
    choices = {key: value for key, value in CHOICES.items() if key != "size of the window"}
    Parameters = CamShiftImprovedParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError as `ColourMotionModel` does."""
        self._centre, self._box_size = box[:2] + box[2:] / 2, box[2:].copy()
        self._window = window_size(box)
        self._ratio = float(box[2] / box[3])
        self._model = ColourMotionModel(
            "camshift-improved", self.parameters, frame, self._centre, self._window
        )

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; raise TrackerError if the frame size changes."""
        parameters, window = self.parameters, self._window
        joint = self._joint = self._model.observe(frame)
        moved = joint.drift(
            self._centre[np.newaxis], window, parameters.stop_distance, parameters.max_iterations
        )
        self._centre = moved.points[0]
        details = {"iterations": float(moved.iterations[0])}
        details |= joint.details(self._centre, window)
        weight = float(moved.after[0]) * joint.unit
        if parameters.window == "adaptive" and weight > 0:
            self._window = adapted_window(weight, self._ratio, frame.image.shape)
            self._box_size = np.array(self._window, np.float64)
        return Estimate(
            np.concatenate([self._centre - self._box_size / 2, self._box_size]),
            visible=weight > 0,
            confidence=details["similarity"],
            details=details,
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """Return the joint map of colour and motion; see `WeightMapTracker.maps`."""
        return {"joint map": self._joint.full_map()}
