"""CamShift: mean shift on a hue back-projection, with a fixed or an adaptive window."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.parameters import (
    TrackerError,
    choice,
    chosen,
    integer,
    nonnegative,
    printed,
)
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.maps.back_projection import (
    MAX_BINS,
    HueBins,
    adapted_window,
    count_bins,
    first_pixel,
    lazy_hue_bins,
    mean_shift,
    window_size,
)
from trackmark.trackers.maps.colour_limits import ColourLimits

__all__ = ["CamShift"]


class CamShiftParameters(ColourLimits):
    """Parameters of `CamShift`."""

    window: Literal["fixed", "adaptive"] = choice(
        "fixed",
        "fixed: the window keeps the size of the init box; adaptive: Bradski's rule sets it once "
        "per frame",
        origin=chosen(
            "section 2.2 lists no size step; Bradski's rule is the other reading of the name "
            "CamShift"
        ),
    )
    hue_bins: int = integer(
        32,
        "number of bins of the hue histogram [count]",
        maximum=MAX_BINS,
        origin=chosen("not printed; a bin then has 11 degrees of hue"),
    )
    stop_distance: float = nonnegative(
        2.0,
        "mean shift stops after a step shorter than this [pixels]",
        origin=printed("section 2.2: ε = 2"),
    )
    max_iterations: int = integer(
        11,
        "maximum number of mean shift steps per frame [count]",
        origin=printed("section 2.2, step 3: stop if n₁ > n₀ = 10, after n₁ was increased"),
    )


class CamShift(SharingTracker):
    """CamShift: mean shift on a hue back-projection, with a fixed or an adaptive window.

    The baseline "traditional CamShift" of Wang & Tang 2010. The template is the hue histogram of
    the init box. The weight of a pixel is the count of its hue bin, divided by the largest count.
    In each frame the window moves to the centroid of its weights until a step is below
    `stop_distance`, at most 11 times as in `camshift-improved`.

    Bradski's CamShift then sets the window's sides to 2 √(M00 · ratio) and 2 √(M00 / ratio). M00 is
    the sum of the weights in the window, `ratio` the init box's width over its height. Wang & Tang
    name Bradski's method but describe only the centroid. So `as-written` and `recommended` keep the
    window's size. Several of the paper's claims depend on this choice, so tables have a row for
    each window rule.

    The box of a fixed window has the exact size of the init box. The box of an adaptive window is
    the window. `confidence` is the mean weight in the window, in [0, 1]. If all weights in the
    window are 0, it is not moved, and the target is not visible.
    """

    paper = (
        "G. R. Bradski, Computer vision face tracking for use in a perceptual user interface, "
        "Intel Technology Journal Q2, 1998; as the baseline of Wang & Tang, An improved "
        "CamShift-based particle filter, J. Image and Graphics 15(10), 2010"
    )
    presets = {"as-written": {}, "recommended": {}}
    choices = {
        "weight of the largest bin of the histogram": (1.0, "the rule of Bradski's CamShift"),
        "hue of grey pixels": (0.0, "not stated; as in MATLAB, which the paper used"),
        "window without weight": ("not moved", "eq. 7 divides by 0"),
    }
    Parameters = CamShiftParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if the box has no area or no weight above 0."""
        x, y, width, height = (float(value) for value in box)
        self._x, self._y = x + width / 2, y + height / 2
        self._box_size = width, height
        self._window = window_size(box)
        self._ratio = width / height
        left = first_pixel(self._x, self._window[0])
        top = first_pixel(self._y, self._window[1])
        self._weights = count_bins(self._hues(frame), left, top, *self._window)
        self._largest = int(self._weights.max())
        if self._largest == 0:
            raise TrackerError(
                f"camshift: no pixel of the box {np.round(box, 1).tolist()} is in the image and "
                "within the limits minimum_saturation, minimum_value and maximum_value. Use "
                "another box, or widen the limits."
            )

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        parameters = self.parameters
        width, height = self._window
        self._x, self._y, iterations, total = mean_shift(
            self._hues(frame),
            self._weights,
            self._x,
            self._y,
            width,
            height,
            parameters.stop_distance,
            parameters.max_iterations,
        )
        mean = total / (self._largest * width * height)
        if parameters.window == "adaptive" and total > 0:
            self._window = adapted_window(total / self._largest, self._ratio, frame.image.shape)
            self._box_size = float(self._window[0]), float(self._window[1])
        box_width, box_height = self._box_size
        return Estimate(
            np.array([self._x - box_width / 2, self._y - box_height / 2, box_width, box_height]),
            visible=total > 0,
            confidence=mean,
            details={"iterations": float(iterations), "mean_back_projection": mean},
        )

    def maps(self, image: Image) -> Mapping[str, NDArray[np.float64]]:
        """Return the hue back-projection; see `WeightMapTracker.maps`."""
        hues = self._hues(SharedFrame(image))
        count_bins(hues, 0, 0, *image.shape[1::-1])  # side effect: computes the bin of every pixel
        return {"back-projection": self._weights[hues.bins] / self._largest}

    def _hues(self, frame: SharedFrame) -> HueBins:
        parameters = self.parameters
        return frame.compute(
            lazy_hue_bins,
            parameters.hue_bins,
            parameters.minimum_saturation,
            parameters.minimum_value,
            parameters.maximum_value,
        )
