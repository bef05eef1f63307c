"""OpenCV's MedianFlow: the median motion of points tracked forward and back."""

from typing import Any

from trackmark.trackers.base.opencv import (
    OpenCVParameters,
    OpenCVTracker,
    find_factory,
    set_legacy_parameters,
)
from trackmark.trackers.base.parameters import nonnegative, positive, whole

__all__ = ["MedianFlow"]


class MedianFlowParameters(OpenCVParameters):
    """Parameters of `MedianFlow`: OpenCV's, with its defaults."""

    grid: int = whole(10, "number of points along each side of the grid [count]", most=100)
    window: int = whole(3, "side of the window of the optical flow [pixels]", least=3)
    levels: int = whole(5, "number of pyramid levels above the image [count]", least=0, most=10)
    max_iterations: int = whole(20, "maximum number of iterations per level [count]")
    stop_distance: float = positive(
        0.3, "the optical flow stops after a step shorter than this [pixels]"
    )
    patch: int = whole(30, "side of the patches that are compared [pixels]", least=2)
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
        settings = self.parameters
        values = {
            "pointsInGrid": settings.grid,
            "winSize": [settings.window] * 2,
            "maxLevel": settings.levels,
            "termCriteria_maxCount": settings.max_iterations,
            "termCriteria_epsilon": settings.stop_distance,
            "winSizeNCC": [settings.patch] * 2,
            "maxMedianLengthOfDisplacementDifference": settings.longest_deviation,
        }
        return set_legacy_parameters(super()._make(), values)
