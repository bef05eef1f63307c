"""OpenCV's Boosting: on-line AdaBoost over Haar features."""

from typing import Any

from trackmark.trackers.base.interface import Randomness
from trackmark.trackers.base.opencv import (
    OpenCVParameters,
    OpenCVTracker,
    factory,
    with_read_parameters,
)
from trackmark.trackers.base.parameters import fraction, positive, whole

__all__ = ["Boosting"]


class BoostingParameters(OpenCVParameters):
    """Parameters of `Boosting`: OpenCV's, with its defaults."""

    # OpenCV draws as many features as its defaults need, whatever is asked for: more would read
    # beyond them.
    classifiers: int = whole(100, "weak classifiers that are chosen [count]", most=100)
    initial_steps: int = whole(50, "steps of learning in the first frame [count]", most=50)
    overlap: float = fraction(0.99, "overlap of neighbouring places that are tried [fraction]")
    search_factor: float = positive(1.8, "region that is searched, over the target's size [ratio]")


class Boosting(OpenCVTracker):
    """OpenCV's Boosting: on-line AdaBoost over Haar features.

    A classifier of target against surroundings, boosted anew in every frame. It draws from
    libc's `rand` in every frame too; OpenCV seeds it always alike, we by the repetition.

    OpenCV's code ends the process for an `overlap` of .5 or 0, and raises for a `search_factor` of
    .5 (seen with 5.0): the former costs the run its process.
    """

    paper = "H. Grabner, M. Grabner, H. Bischof, Real-time tracking via on-line boosting, BMVC 2006"
    Parameters = BoostingParameters
    create_tracker = factory("Boosting")
    randomness = Randomness.PROCESS
    smallest_side = 5

    def _make(self) -> Any:
        settings = self.parameters
        values = {
            "numClassifiers": settings.classifiers,
            "iterationInit": settings.initial_steps,
            "overlap": settings.overlap,
            # OpenCV knows it by two names, of which the second counts.
            "samplerSearchFactor": settings.search_factor,
            "searchFactor": settings.search_factor,
        }
        return with_read_parameters(super()._make(), values)
