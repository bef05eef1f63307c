"""OpenCV's Boosting: on-line AdaBoost over Haar features."""

from trackers.base.interface import Randomness
from trackers.base.opencv import OpenCVTracker, factory

__all__ = ["Boosting"]


class Boosting(OpenCVTracker):
    """OpenCV's Boosting: on-line AdaBoost over Haar features.

    A classifier of target against surroundings, boosted anew in every frame. It draws from
    libc's `rand` in every frame too; OpenCV seeds it always alike, we by the repetition.
    """

    paper = "H. Grabner, M. Grabner, H. Bischof, Real-time tracking via on-line boosting, BMVC 2006"
    create_tracker = factory("Boosting")
    randomness = Randomness.PROCESS
    smallest_side = 5
