"""Improved CamShift inside a particle filter, on colour and motion (Wang & Tang 2010)."""

from trackmark.trackers.base.parameters import nonnegative, whole
from trackmark.trackers.maps.place_filter import ROBUST, CloudParameters, PlaceFilter

__all__ = ["Wang2010"]


class Wang2010Parameters(CloudParameters):
    """Parameters of `Wang2010`."""

    stop_distance: float = nonnegative(
        2.0, "ε: a mean shift step shorter than this is the last one [pixels]"
    )
    max_iterations: int = whole(10, "n₀: most mean shift steps of a particle in a frame [count]")


class Wang2010(PlaceFilter):
    """Improved CamShift inside a particle filter, on colour and motion.

    The target is the hue and the saturation histogram of the first box. A pixel's colour weighs
    I_c = α hue + (1 - α) saturation, either in units of its histogram's largest bin (equation 3).
    A pixel moves where the differences of the last three frames, summed over a small window and
    averaged, exceed their mean by λ deviations. Where it moves it weighs I_c, elsewhere (1 - β) I_c
    (equation 5). A particle is the place of a window of the first box's size. In each frame
    it goes on with its own last step and a throw of up to r either way (equation 8), climbs to the
    centroid of the weights in the window (equations 6 and 7), and weighs exp(-D² / 2σ²) with
    D² = 1 - M / M₀, M / M₀ being the mean weight in the window (equations 9 and 10). The estimate
    is the mean by these weights (equation 12), taken before systematic resampling.

    After the climb the particles no longer are draws from the transition's density: to weigh them
    by the observation alone is the paper's approximation, and no case of its equation 2. There is
    no detector of loss, no update of the model, and the size stays.

    Equation 10 has no scale: with D in [0, 1] its weights differ by a factor of 1.65 at most.
    So `as-written` has σ = 1. `recommended`, the same as `sharp`, has σ = 0.158, which is that of
    Pérez et al. (exp(-20 D²), ECCV 2002), taken from the literature and not from results. `robust`
    (σ = 0.1, r = 10, ε = 0.5, n = 7) is for recorded video, and post hoc. The
    paper names no bins (32 each here) and no n (5 here), on which much depends. "At most n₀"
    iterations is our reading; literally n₀ + 1 are allowed, `max_iterations=11`.

    Motion is seen in grey, R + G + B: a target as bright as what is behind it hardly moves. And the
    camera must stand still. Where it moves, edges change all over the image, the threshold
    rises with them, and what passes it says nothing of the target. The details tell: `changing` is
    some per cent with a camera at rest and a fifth to a half with one that moves, and then little
    more moves inside the window (`moving_inside`) than elsewhere (`moving`). `beta=0` does without
    motion, `alpha=1` with hue alone.

    Details: `effective_sample_size` (1 / Σ w² over N, in (0, 1]), `weight_ratio` (largest weight
    times N), `spread` (root mean square distance of the particles from their mean, pixels),
    `modes` (pixels that hold a particle's place), `iterations` (mean of a particle's),
    `similarity` (M / M₀ at the estimate, which is the confidence too), `moving` and
    `moving_inside` (share of the pixels of the image and of the window that move), `changing`
    (share of the pixels around which the frame differs by 8 grey levels or more). Arrays:
    `particles` and `predicted` (N, 2), places x, y after and before the climb; `weights`,
    `similarity` and `predicted_similarity` (N,).
    """

    name = "wang2010"
    paper = (
        "X. Wang, Z. Tang, An improved camshift-based particle filter algorithm for real-time "
        "target tracking, Journal of Image and Graphics 15(10), 2010 (in Chinese)"
    )
    presets = {
        "as-written": {"sigma": 1.0},
        "recommended": {},
        "sharp": {},
        "robust": ROBUST | {"stop_distance": 0.5},
    }
    Parameters = Wang2010Parameters

    def drift_rule(self) -> tuple[float, int]:
        """See `PlaceFilter.drift_rule`."""
        return self.parameters.stop_distance, self.parameters.max_iterations
