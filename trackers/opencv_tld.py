"""OpenCV's TLD: tracking, learning and detection."""

from trackmark.trackers.base.interface import Randomness
from trackmark.trackers.base.opencv import OpenCVTracker, factory

__all__ = ["TLD"]


class TLD(OpenCVTracker):
    """OpenCV's TLD: tracking, learning and detection.

    A median flow tracker beside a cascaded detector that learns from what both say. Its
    detector is drawn from libc's `rand` when it is initialised.

    OpenCV's code ends in a segmentation fault for many long and thin boxes, and in images
    hardly larger than the target (seen with 4.14 and 5.0). That costs the run its process.
    """

    paper = (
        "Z. Kalal, K. Mikolajczyk, J. Matas, Tracking-learning-detection, IEEE TPAMI 34(7), 2012"
    )
    create_tracker = factory("TLD")
    randomness = Randomness.PROCESS
    smallest_side = 3
