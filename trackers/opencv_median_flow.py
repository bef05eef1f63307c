"""OpenCV's MedianFlow: the median motion of points tracked forward and back."""

from trackers.base.opencv import OpenCVTracker, factory

__all__ = ["MedianFlow"]


class MedianFlow(OpenCVTracker):
    """OpenCV's MedianFlow: the median motion of points tracked forward and back.

    A grid of points is followed by optical flow; those that do not return to where they came
    from are dropped, and the medians of the rest move and scale the box.
    """

    paper = (
        "Z. Kalal, K. Mikolajczyk, J. Matas, Forward-backward error: automatic detection of "
        "tracking failures, ICPR 2010"
    )
    create_tracker = factory("MedianFlow")
