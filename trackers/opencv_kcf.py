"""OpenCV's KCF: kernelised correlation filters."""

from trackers.base.opencv import OpenCVTracker, factory

__all__ = ["KCF"]


class KCF(OpenCVTracker):
    """OpenCV's KCF: kernelised correlation filters.

    A ridge regression over all cyclic shifts of the target, solved by Fourier transforms. It
    keeps the first size, and says when it has lost the target.
    """

    paper = (
        "J. F. Henriques, R. Caseiro, P. Martins, J. Batista, High-speed tracking with "
        "kernelized correlation filters, IEEE TPAMI 37(3), 2015"
    )
    create_tracker = factory("KCF")
