"""OpenCV's MOSSE: the first adaptive correlation filter."""

from trackmark.trackers.base.opencv import OpenCVTracker, find_factory

__all__ = ["MOSSE"]


class MOSSE(OpenCVTracker):
    """OpenCV's MOSSE: the first adaptive correlation filter.

    The filter on grey values is trained such that its response to the target is a sharp peak. It is
    updated in every frame. The tracker keeps the initial size and reports a lost target.
    """

    paper = (
        "D. S. Bolme, J. R. Beveridge, B. A. Draper, Y. M. Lui, Visual object tracking using "
        "adaptive correlation filters, CVPR 2010"
    )
    create_tracker = find_factory("MOSSE")
    smallest_side = 2
