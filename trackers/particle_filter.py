"""Traditional particle filter: the baseline of Wang & Tang 2010."""

from trackmark.trackers.base.parameters import integer, printed
from trackmark.trackers.maps import position_filter

__all__ = ["ParticleFilter"]


class ParticleFilterParameters(position_filter.PositionFilterParameters):
    """Parameters of `ParticleFilter`."""

    particles: int = integer(
        400,
        "number of particles N [count]",
        maximum=100_000,
        origin=printed("Table 1: N = 400"),
    )


class ParticleFilter(position_filter.PositionFilter):
    """Traditional particle filter: `wang2010` without mean shift.

    The paper says: "The same state transition and observation model". A particle is the position of
    a window of the init box's size. It moves by its last step and a random displacement of up to r
    per axis. Its likelihood is exp(-D² / 2σ²), by the mean of the joint map in its window
    (equations 8 to 12). Particles are samples of the transition density, so these weights follow
    from equation 2.

    "The same" may mean the formula r = √N / 2, 10 pixels for N = 400, or the r of the proposed
    tracker, 3.87 pixels (`radius=3.87`). `as-written` uses the formula, which gives about one
    particle per pixel for any N. Results depend on r, so tables have a row for both values.

    Presets, details, arrays and the uncertainty about σ are those of `wang2010`.
    """

    name = "particle-filter"
    paper = (
        "the baseline of X. Wang, Z. Tang, An improved camshift-based particle filter algorithm "
        "for real-time target tracking, Journal of Image and Graphics 15(10), 2010 (in Chinese)"
    )
    Parameters = ParticleFilterParameters
