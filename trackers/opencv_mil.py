"""OpenCV's MIL: boosting over bags of instances."""

from typing import Any

from trackmark.trackers.base.interface import Randomness
from trackmark.trackers.base.opencv import OpenCVTracker, find_factory
from trackmark.trackers.base.parameters import Parameters, integer, positive

__all__ = ["MIL"]


class MILParameters(Parameters):
    """Parameters of `MIL`, with OpenCV's defaults."""

    initial_radius: float = positive(3.0, "radius of the positive bag in the first frame [pixels]")
    initial_negatives: int = integer(65, "number of negative samples in the first frame [count]")
    search_window: float = positive(25.0, "search radius around the last position [pixels]")
    track_radius: float = positive(4.0, "radius of the positive bag while tracking [pixels]")
    track_positives: int = integer(
        100_000, "maximum number of positive samples while tracking [count]"
    )
    track_negatives: int = integer(65, "number of negative samples while tracking [count]")
    features: int = integer(250, "number of candidate Haar features [count]")


class MIL(OpenCVTracker):
    """OpenCV's MIL: boosting over bags of instances.

    A classifier is trained on bags of patches around the last box, which tolerates slightly
    misplaced boxes. It keeps the initial size and never reports a lost target.

    `init` draws features by libc's `rand` and by OpenCV's generator, which belong to the whole
    process.
    """

    paper = (
        "B. Babenko, M.-H. Yang, S. Belongie, Visual tracking with online multiple instance "
        "learning, CVPR 2009"
    )
    randomness = Randomness.PROCESS
    Parameters = MILParameters
    create_tracker = find_factory("MIL")
    opencv_parameters = "TrackerMIL_Params"
    smallest_side = 5

    def _opencv_values(self) -> dict[str, Any]:
        parameters = self.parameters
        return {
            "samplerInitInRadius": parameters.initial_radius,
            "samplerInitMaxNegNum": parameters.initial_negatives,
            "samplerSearchWinSize": parameters.search_window,
            "samplerTrackInRadius": parameters.track_radius,
            "samplerTrackMaxPosNum": parameters.track_positives,
            "samplerTrackMaxNegNum": parameters.track_negatives,
            "featureSetNumFeatures": parameters.features,
        }
