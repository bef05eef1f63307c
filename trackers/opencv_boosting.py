"""OpenCV's Boosting: on-line AdaBoost over Haar features."""

from typing import Any

from trackmark.trackers.base.interface import Randomness
from trackmark.trackers.base.opencv import (
    OpenCVTracker,
    find_factory,
    set_legacy_parameters,
)
from trackmark.trackers.base.parameters import Parameters, fraction, integer, positive

__all__ = ["Boosting"]


class BoostingParameters(Parameters):
    """Parameters of `Boosting`: OpenCV's, with its defaults."""

    # OpenCV always creates the number of features for its defaults. With larger values, it would
    # read beyond the end of the array of features.
    classifiers: int = integer(100, "number of selected weak classifiers [count]", maximum=100)
    initial_steps: int = integer(
        50, "number of learning steps in the first frame [count]", maximum=50
    )
    overlap: float = fraction(0.99, "overlap of neighbouring positions in the search [fraction]")
    search_factor: float = positive(1.8, "size of the search region / size of the target [ratio]")


class Boosting(OpenCVTracker):
    """OpenCV's Boosting: on-line AdaBoost over Haar features.

    A classifier that separates the target from its surroundings is updated in every frame. It uses
    libc's `rand`. OpenCV seeds `rand` with a constant; this class uses the seed of the repetition.

    OpenCV 5.0 terminates the process for an `overlap` of 0.5 or 0, so that the run fails. It raises
    an error for a `search_factor` of 0.5.
    """

    paper = "H. Grabner, M. Grabner, H. Bischof, Real-time tracking via on-line boosting, BMVC 2006"
    Parameters = BoostingParameters
    create_tracker = find_factory("Boosting")
    randomness = Randomness.PROCESS
    smallest_side = 5

    def _make(self) -> Any:
        parameters = self.parameters
        values = {
            "numClassifiers": parameters.classifiers,
            "iterationInit": parameters.initial_steps,
            "overlap": parameters.overlap,
            # OpenCV reads both names; the second one takes effect.
            "samplerSearchFactor": parameters.search_factor,
            "searchFactor": parameters.search_factor,
        }
        return set_legacy_parameters(super()._make(), values)
