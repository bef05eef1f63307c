"""OpenCV's CamShift on a hue back-projection."""

import cv2
import numpy as np

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, TrackerPlugin
from trackmark.trackers.base.opencv import pixel_rectangle
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    fraction,
    integer,
    nonnegative,
)

__all__ = ["OpenCVCamShift"]

N_HUES = 180  # hue values of OpenCV's 8-bit HSV


class OpenCVCamShiftParameters(Parameters):
    """Parameters of `OpenCVCamShift`."""

    hue_bins: int = integer(32, "number of bins of the hue histogram [count]", maximum=N_HUES)
    stop_distance: float = nonnegative(
        2.0, "mean shift stops after a step shorter than this [pixels]"
    )
    max_iterations: int = integer(10, "maximum number of mean shift steps per frame [count]")
    minimum_saturation: float = fraction(
        0.0, "pixels with a lower saturation get weight 0 [fraction]"
    )
    minimum_value: float = fraction(0.0, "pixels with a lower value (HSV) get weight 0 [fraction]")
    maximum_value: float = fraction(1.0, "pixels with a higher value (HSV) get weight 0 [fraction]")


class OpenCVCamShift(TrackerPlugin):
    """OpenCV's CamShift on a hue back-projection.

    OpenCV's definition differs from `camshift`. After convergence, OpenCV enlarges the window by
    ten pixels on each side and fits its size by second moments. It rounds all values to whole
    pixels, and the back-projection to bytes. By default all pixels count, as in `camshift`. The
    tracker loses fewer targets if pale and dark pixels are excluded (`minimum_saturation`,
    `minimum_value`). This tracker is for comparison only; no claim of a paper uses it. The box is
    the window. If the window becomes empty, the last one is kept and the target is not visible.
    """

    paper = (
        "G. R. Bradski, Computer vision face tracking for use in a perceptual user interface, "
        "Intel Technology Journal Q2, 1998; as OpenCV has it"
    )
    Parameters = OpenCVCamShiftParameters

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if no pixel of the box is within the limits."""
        parameters = self.parameters
        x, y, width, height = self._window = pixel_rectangle(box, image)
        patch = image[y : y + height, x : x + width]
        hsv = np.asarray(cv2.cvtColor(patch, cv2.COLOR_BGR2HSV), np.uint8)
        counts = cv2.calcHist([hsv], [0], self._counted(hsv), [parameters.hue_bins], [0, N_HUES])
        if counts.max() == 0:
            raise TrackerError(
                f"opencv-camshift: no pixel of the box {np.round(box, 1).tolist()} is within the "
                "limits minimum_saturation, minimum_value and maximum_value. Use another box, or "
                "widen the limits."
            )
        self._weights = counts * np.float32(255 / counts.max())

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        parameters = self.parameters
        hsv = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), np.uint8)
        weights = cv2.calcBackProject([hsv], [0], self._weights, [0, N_HUES], 1)
        weights = cv2.bitwise_and(weights, self._counted(hsv))
        criteria = (
            cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT,
            parameters.max_iterations,
            parameters.stop_distance,
        )
        (_, size, _), (x, y, width, height) = cv2.CamShift(weights, self._window, criteria)
        has_area = max(size) > 0 and min(width, height) > 0  # the size is 0 if all weights are 0
        if has_area:
            self._window = x, y, width, height
        return Estimate(np.array(self._window, np.float64), visible=has_area)

    def _counted(self, hsv: Image) -> Image:
        """Return 255 for pixels within the limits, 0 for others."""
        parameters = self.parameters
        minimum = (0, 255 * parameters.minimum_saturation, 255 * parameters.minimum_value)
        maximum = (255, 255, 255 * parameters.maximum_value)
        return np.asarray(cv2.inRange(hsv, minimum, maximum), np.uint8)
