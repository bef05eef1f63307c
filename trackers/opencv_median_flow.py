"""OpenCV's MedianFlow: the median motion of points tracked forward and back."""

from typing import Any

from trackmark.trackers.base.opencv import (
    OpenCVTracker,
    find_factory,
    set_legacy_parameters,
)
from trackmark.trackers.base.parameters import Parameters, integer, nonnegative, positive

__all__ = ["MedianFlow"]


class MedianFlowParameters(Parameters):
    """Parameters of `MedianFlow`: OpenCV's, with its defaults."""

    grid: int = integer(10, "number of points along each side of the grid [count]", maximum=100)
    window: int = integer(3, "side of the window of the optical flow [pixels]", minimum=3)
    levels: int = integer(
        5, "number of pyramid levels above the image [count]", minimum=0, maximum=10
    )
    max_iterations: int = integer(20, "maximum number of iterations per level [count]")
    stop_distance: float = positive(
        0.3, "the optical flow stops after a step shorter than this [pixels]"
    )
    patch: int = integer(30, "side of the patches that are compared [pixels]", minimum=2)
    longest_deviation: float = nonnegative(
        10.0,
        "maximum median difference of point motions from their median; above, the target is lost "
        "[pixels]",
    )


class MedianFlow(OpenCVTracker):
    """OpenCV's MedianFlow: the median motion of points tracked forward and back.

    A grid of points is tracked by optical flow, forward and back. Points that do not return to
    their start are discarded. The medians of the other points move and scale the box.
    """

    paper = (
        "Z. Kalal, K. Mikolajczyk, J. Matas, Forward-backward error: automatic detection of "
        "tracking failures, ICPR 2010"
    )
    Parameters = MedianFlowParameters
    create_tracker = find_factory("MedianFlow")

    def _make(self) -> Any:
        parameters = self.parameters
        values = {
            "pointsInGrid": parameters.grid,
            "winSize": [parameters.window] * 2,
            "maxLevel": parameters.levels,
            "termCriteria_maxCount": parameters.max_iterations,
            "termCriteria_epsilon": parameters.stop_distance,
            "winSizeNCC": [parameters.patch] * 2,
            "maxMedianLengthOfDisplacementDifference": parameters.longest_deviation,
        }
        return set_legacy_parameters(super()._make(), values)
