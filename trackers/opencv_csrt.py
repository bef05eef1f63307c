"""OpenCV's CSRT: a correlation filter with channel and spatial reliability."""

from trackers.base.opencv import OpenCVTracker, factory

__all__ = ["CSRT"]


class CSRT(OpenCVTracker):
    """OpenCV's CSRT: a correlation filter with channel and spatial reliability.

    A correlation filter over colour names and gradients, held to the target by a map of
    which of its pixels can be relied on; it follows changes of size.
    """

    paper = (
        "A. Lukežič, T. Vojíř, L. Čehovin Zajc, J. Matas, M. Kristan, Discriminative "
        "correlation filter with channel and spatial reliability, CVPR 2017"
    )
    create_tracker = factory("CSRT")
    smallest_side = 2
