"""OpenCV's MOSSE: the first adaptive correlation filter."""

from trackmark.trackers.base.opencv import OpenCVTracker, find_factory

__all__ = ["MOSSE"]


class MOSSE(OpenCVTracker):
    """OpenCV's MOSSE: the first adaptive correlation filter.

    A filter on grey values whose response to the target is a sharp peak, updated in every frame. It
    keeps the initial size and reports a lost target.
    """

    paper = (
        "D. S. Bolme, J. R. Beveridge, B. A. Draper, Y. M. Lui, Visual object tracking using "
        "adaptive correlation filters, CVPR 2010"
    )
    create_tracker = find_factory("MOSSE")
    smallest_side = 2
