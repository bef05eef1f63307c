"""Particle filter with improved CamShift, on colour and motion (Wang & Tang 2010)."""

from trackmark.trackers.base.parameters import integer, nonnegative, printed
from trackmark.trackers.maps import position_filter

__all__ = ["Wang2010"]


class Wang2010Parameters(position_filter.PositionFilterParameters):
    """Parameters of `Wang2010`."""

    stop_distance: float = nonnegative(
        2.0,
        "ε: mean shift stops after a step shorter than this [pixels]",
        origin=printed("section 2.2: ε = 2"),
    )
    max_iterations: int = integer(
        11,
        "n₀ + 1: maximum number of mean shift steps of a particle per frame [count]",
        origin=printed("section 2.2, step 3: stop if n₁ > n₀ = 10, after n₁ was increased"),
    )


class Wang2010(position_filter.PositionFilter):
    """Particle filter with improved CamShift, on colour and motion.

    The target model is the hue and saturation histogram of the init box. The colour weight of a
    pixel is I_c = α hue + (1 - α) saturation, each relative to its histogram's largest bin
    (equation 3). A pixel moves if the averaged differences of the last three frames, summed over a
    small window, exceed their mean by λ standard deviations. The weight of a moving pixel is I_c,
    the weight of others is (1 - β) I_c (equation 5).

    A particle is the position of a window of the init box's size. In each frame it moves by its
    last step and a random displacement of up to r per axis (equation 8). Mean shift then moves it
    to the centroid of the weights in its window (equations 6 and 7). Its likelihood is exp(-D² /
    2σ²) with D² = 1 - M / M₀, where M / M₀ is the mean weight in the window (equations 9 and 10).
    The estimate is the weighted mean (equation 12) before systematic resampling.

    After mean shift, particles are not samples of the transition density. Weighting them by the
    likelihood alone is the paper's approximation and does not follow from its equation 2. There is
    no detection of loss, no model update and no change of size.

    Equation 10 has no scale: with D in [0, 1], its weights differ at most by a factor of 1.65. So
    `as-written` has σ = 1. `recommended` has σ = 0.158, the value of Pérez et al. (exp(-20 D²),
    ECCV 2002); it comes from the literature, not from results. The paper states neither the numbers
    of bins (here 32 for hue and for saturation) nor n (here 5), although results depend on them.
    Section 2.2 stops mean shift if n₁ > n₀ = 10, after n₁ was increased, so there are up to 11
    steps. The mean is 1.3.

    Motion is measured in grey, R + G + B: a target as bright as its background shows little motion.
    The camera must not move. Otherwise, edges change in the whole image and raise the threshold, so
    that the motion map is unrelated to the target. In that case, `changing` is 20 to 50 % instead
    of a few per cent, and `moving_inside` is hardly above `moving`. `beta=0` disables motion,
    `alpha=1` saturation.

    Details: `effective_sample_size` is 1 / (N Σ w²), in (0, 1], and `weight_ratio` the largest
    weight times N. `spread` is the root mean square distance of particles from their mean [pixels],
    `modes` the number of different pixels with a particle, `iterations` the mean per particle.
    `similarity` is M / M₀ at the estimate, also the confidence. `moving` and `moving_inside` are
    the shares of moving pixels in the image and in the window, `changing` the share of pixels whose
    surroundings change by 8 grey levels or more. Arrays: `particles` and `predicted` (N, 2),
    positions x, y after and before mean shift; `weights`, `similarity` and `predicted_similarity`
    (N,).
    """

    name = "wang2010"
    paper = (
        "X. Wang, Z. Tang, An improved camshift-based particle filter algorithm for real-time "
        "target tracking, Journal of Image and Graphics 15(10), 2010 (in Chinese)"
    )
    Parameters = Wang2010Parameters

    def drift_rule(self) -> tuple[float, int]:
        """See `PositionFilter.drift_rule`."""
        return self.parameters.stop_distance, self.parameters.max_iterations
