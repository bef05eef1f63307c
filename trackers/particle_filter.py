"""The traditional particle filter that Wang & Tang 2010 compare theirs with."""

from trackmark.trackers.base.parameters import whole
from trackmark.trackers.maps.place_filter import ROBUST, CloudParameters, PlaceFilter

__all__ = ["ParticleFilter"]


class ParticleFilterParameters(CloudParameters):
    """Parameters of `ParticleFilter`."""

    particles: int = whole(400, "number of particles N [count]", most=100_000)


class ParticleFilter(PlaceFilter):
    """The traditional particle filter: that of `wang2010` without the climb.

    "The same state transition and observation model": a particle is the place of a window of the
    first box's size, goes on with its own last step and a throw of up to r either way, and weighs
    exp(-D² / 2σ²) by the mean of the joint colour and motion map in its window (equations 8 to 12).
    Its particles are draws from the transition's density, so that equation 2 gives these weights.

    "The same" may mean the formula r = √N / 2, 10 pixels for N = 400, or the same r as the
    proposed tracker's, 3.87 (`radius=3.87`). The formula is `as-written`: it has about one particle
    a pixel whatever N is. How far particles reach decides much, so tables have a row for each.

    Presets, details and arrays are those of `wang2010`; its doubts about σ hold here too.
    """

    name = "particle-filter"
    paper = (
        "the baseline of X. Wang, Z. Tang, An improved camshift-based particle filter algorithm "
        "for real-time target tracking, Journal of Image and Graphics 15(10), 2010 (in Chinese)"
    )
    presets = {"as-written": {"sigma": 1.0}, "recommended": {}, "sharp": {}, "robust": ROBUST}
    Parameters = ParticleFilterParameters
