"""OpenCV's MOSSE: the first adaptive correlation filter."""

from trackmark.trackers.base.opencv import OpenCVTracker, factory

__all__ = ["MOSSE"]


class MOSSE(OpenCVTracker):
    """OpenCV's MOSSE: the first adaptive correlation filter.

    A grey-value filter whose answer to the target is a sharp peak, updated in every frame. It
    keeps the first size, and says when it has lost the target.
    """

    paper = (
        "D. S. Bolme, J. R. Beveridge, B. A. Draper, Y. M. Lui, Visual object tracking using "
        "adaptive correlation filters, CVPR 2010"
    )
    create_tracker = factory("MOSSE")
    smallest_side = 2
