"""OpenCV's TLD: tracking, learning and detection."""

from trackmark.trackers.base.interface import Randomness
from trackmark.trackers.base.opencv import OpenCVTracker, find_factory

__all__ = ["TLD"]


class TLD(OpenCVTracker):
    """OpenCV's TLD: tracking, learning and detection.

    A median flow tracker is combined with a cascaded detector. The detector is trained on the
    results of both. `init` draws the detector's features by libc's `rand`.

    OpenCV 4.14 and 5.0 crash with a segmentation fault for many long and thin boxes, and in images
    that are hardly larger than the target. The run then fails.
    """

    paper = (
        "Z. Kalal, K. Mikolajczyk, J. Matas, Tracking-learning-detection, IEEE TPAMI 34(7), 2012"
    )
    create_tracker = find_factory("TLD")
    randomness = Randomness.PROCESS
    smallest_side = 3
