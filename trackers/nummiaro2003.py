"""Adaptive particle filter on kernel-weighted colour histograms of ellipses."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    bounded,
    choice,
    chosen,
    fraction,
    integer,
    nonnegative,
    positive,
    printed,
)
from trackmark.trackers.base.particles import mean_state, multinomial, normalise_log_weights
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms import motion, target_model
from trackmark.trackers.histograms.bins import ColourSpace, JointBins
from trackmark.trackers.histograms.ellipses import Kernel

__all__ = ["Nummiaro2003"]


class Nummiaro2003Parameters(Parameters):
    """Parameters of `Nummiaro2003`; the defaults are the values of the preset `as-written`."""

    particles: int = integer(
        100, "number of particles N [count]", maximum=100_000, origin=printed("section 7: N = 100")
    )
    colour: ColourSpace = choice(
        "rgb", "colour space of the histograms", origin=printed("section 3: RGB space")
    )
    bins: int = integer(
        8,
        "number of bins per channel; V of hsv has half as many [count]",
        2,
        32,
        origin=printed("section 3: 8 × 8 × 8 bins"),
    )
    kernel: Kernel = choice(
        "isotropic",
        "kernel weight of a pixel, which decreases with distance / √(Hx² + Hy²) (isotropic) or "
        "with (dx / Hx)² + (dy / Hy)² (epanechnikov), or is constant (uniform)",
        origin=printed("eq. 2 and 3: k(r) = 1 - r², a = √(Hx² + Hy²)"),
    )
    sigma: float = positive(
        0.1,
        "σ of the likelihood [histogram distance]",
        origin=chosen(
            "not printed; for σ below 0.196 the factor 1 / √(2πσ) of eq. 10 exceeds π_T = 0.9, so "
            "that eq. 11 can be met"
        ),
    )
    dynamics: motion.Dynamics = choice(
        "first-order",
        "quantities that are constant except for noise: velocity and change of scale "
        "(first-order), their rates of change (second-order), or position and size (random-walk)",
        origin=printed("section 4: first order model"),
    )
    axes: motion.Axes = choice(
        "together",
        "together: one size noise for both half axes; apart: one for each",
        origin=chosen(
            "not printed; the state has one scale change a' for both half axes; Hx / Hy stays fixed"
        ),
    )
    scale_change: motion.ScaleChange = choice(
        "linear",
        "half axes change by sums, as in A s + w, or by factors",
        origin=printed("section 4: s_t = A s_(t-1) + w_(t-1)"),
    )
    scale_persistence: float = fraction(
        1.0,
        "factor by which the change of scale is multiplied in each frame [ratio]",
        origin=printed("section 4: constant velocity and scale change"),
    )
    position_noise: float = nonnegative(
        0.12,
        "standard deviation of the centre's noise [half widths]",
        origin=chosen("w is not printed; in half widths, so that it scales with the target"),
    )
    velocity_noise: float = nonnegative(
        0.05,
        "standard deviation of the velocity's noise [half widths/frame]",
        origin=chosen("w is not printed; less than half of the centre's noise"),
    )
    size_noise: float = nonnegative(
        0.01,
        "standard deviation of the half axes' noise [half widths]",
        origin=chosen("w is not printed; chosen after results on earlier scenes had been seen"),
    )
    scale_noise: float = nonnegative(
        0.003,
        "standard deviation of the scale change's noise [half widths/frame]",
        origin=chosen("w is not printed; chosen after results on earlier scenes had been seen"),
    )
    model_update: bool = choice(
        True,
        "whether the target model is updated by the estimate's histogram",
        origin=printed("eq. 12"),
    )
    update_reading: target_model.Interpretation = choice(
        "printed",
        "quantity of the mean state that must exceed the update threshold: its likelihood with "
        "the printed factor (printed), with that of a Gaussian density (density), with a maximum "
        "of 1 (peak), or with σ as the variance, also in weights (variance); its coefficient; or "
        "none (always)",
        origin=printed("eq. 10 and 11: π = exp(-(1 - ρ) / 2σ²) / √(2πσ)"),
    )
    update_threshold: float = positive(
        0.9,
        "π_T: threshold of this quantity [unit of the quantity]",
        origin=printed("section 5: π_T = 0.9"),
    )
    alpha: float = fraction(
        0.1,
        "weight of the mean state's histogram in an update [ratio]",
        origin=chosen("α of eq. 12 is not printed; the model then forgets in about ten updates"),
    )
    models: Literal["one", "per-particle"] = choice(
        "one",
        "target model: one for all particles, or one per particle",
        origin=printed("eq. 12: one model q, updated by the histogram of E[S]"),
    )
    reinitialise: bool = choice(
        True,
        "whether initialisation starts again if too few particles are similar to the target",
        origin=printed("section 6: the tracker returns into the initialization mode"),
    )
    kick_off: float = bounded(
        0.1,
        "b: minimum share of similar particles for tracking, exclusive [ratio]",
        ge=0.0,
        lt=1.0,
        origin=printed("section 6: b = 0.1"),
    )
    loss_frames: int = integer(
        3,
        "number of frames with fewer similar particles after which the target counts as lost "
        "[frames]",
        origin=chosen("section 6: a couple of frames, without a number"),
    )
    placement: motion.Placement = choice(
        "last",
        "positions at which a lost target is searched: half at the borders and half at its last "
        "position (last), mostly at its predicted position (predicted), at the borders, or in "
        "the whole image",
        origin=chosen(
            "section 6 places samples where the target is expected to appear, without a rule for "
            "a lost target; chosen after results on earlier scenes had been seen"
        ),
    )
    appearance: Literal["current", "first"] = choice(
        "current",
        "model with which particles are compared to count similar ones",
        origin=chosen("not printed; eq. 15 names the target histogram q, which eq. 12 updates"),
    )
    background_positions: int = integer(
        1000,
        "approximate number of positions at which the background is sampled [count]",
        origin=chosen(
            "section 6: all the positions of the background; a grid has about the same mean"
        ),
    )


class Nummiaro2003(SharingTracker):
    """Adaptive particle filter on kernel-weighted colour histograms of ellipses.

    The state is x, y, vx, vy, Hx, Hy, a'. In each frame, N particles are resampled and propagated.
    Their weight is exp(-(1 - ρ) / 2σ²), where ρ is the Bhattacharyya coefficient of their histogram
    and the target model (equations 6 and 10). The estimate is the weighted mean (equation 1), not
    rounded. If the likelihood of the mean state exceeds π_T (equation 11), the model q becomes (1 -
    α) q + α p (equation 12), where p is the mean state's histogram.

    A particle is similar to the target if its ρ exceeds μ + 2σ of the background (equations 13 to
    15). If more than b N particles are similar, initialisation ends. If fewer are similar for some
    frames, initialisation starts again. During initialisation, the positions of particles do not
    depend on the previous frame.

    The tracker can be initialised by a box, by a histogram (`init_by_histogram`), or by a detector
    (`init_by_detector`). The background is the last frame before the target appears (`watch`);
    otherwise it is the first frame without the target's surroundings.

    `as-written` has the printed equations and numbers. The text states neither σ, α and the noise,
    nor the length of "a couple of frames", nor the positions of particles during initialisation.
    `recommended` multiplies the change of scale by 0.9 in each frame, because otherwise the
    variance of the size grows without bound. It updates the model if ρ exceeds 0.9, because this
    interpretation of π_T does not depend on σ. Particles of a lost target are placed around its
    predicted position, "where the target is expected to appear" (section 6). `robust` is for
    recorded video; docs/presets.md describes its selection. With one model per particle, the mean
    of these models determines the threshold.

    Details: `positive_appearances` (number of similar particles), `mode` (1: tracking, 0:
    initialisation), `half_width` and `half_height` (Hx and Hy of the estimate [pixels]),
    `coefficient` and `likelihood` of the mean state (in [0, 1]), `updated` (share of models
    updated) and `appearance_threshold` (μ + 2σ). During initialisation, the box is the last
    estimate, not visible. Arrays: `particles` (N, 7), `weights` (N,).
    """

    paper = (
        "Nummiaro, Koller-Meier & Van Gool: Color features for tracking non-rigid objects, "
        "Acta Automatica Sinica 29(3), 2003"
    )
    randomness = Randomness.GENERATOR
    presets = {
        "as-written": {},
        "recommended": {
            "update_reading": "coefficient",
            "scale_persistence": 0.9,
            "placement": "predicted",
        },
        "robust": {"dynamics": "random-walk", "position_noise": 0.6, "size_noise": 0.015}
        | {"sigma": 0.06, "colour": "hsv", "bins": 16, "alpha": 0.02, "particles": 300}
        | {"update_reading": "coefficient", "placement": "predicted"},
    }
    choices = {
        "minimum part of an ellipse in the image, below which ρ is 0": (
            target_model.MIN_SHARE,
            "the sums of eq. 3 need pixels; a histogram of few pixels is noise",
        ),
        "minimum half axis [pixels]": (
            motion.MIN_HALF_AXIS,
            "a smaller ellipse has too few pixels for a histogram of 512 bins",
        ),
        "unit of the four noises": (
            "Hx of the last estimate",
            "w is not printed; the noise then scales with the target and is linear in s",
        ),
        "velocity and scale change of placed particles": (
            0.0,
            "section 6 places samples without a word on their motion",
        ),
        "excluded surroundings of the target in the first frame [half axes]": (
            target_model.SURROUNDINGS,
            "the background is the first frame if no frame without the target precedes it",
        ),
        "positions from which the threshold is computed again": (
            "those of the first frame, after each update",
            "μ and σ of eq. 13 and 14 depend on q, and q changes",
        ),
        "last position of a lost target": (
            "the last mean state with more than half of the particles similar to the target",
            "not printed; later mean states can lie on the background",
        ),
        "share of particles near the last position of a lost target": (
            motion.NEAR_SHARE,
            "section 6 names places where the target is expected and image borders",
        ),
        "deviations of these particles in x and y [Hx]": (
            motion.NEAR_SPREAD,
            "not printed; a lost target of everyday speed moves less in a few frames, mostly "
            "across",
        ),
        "share of particles near the predicted position, with `placement=predicted`": (
            motion.PREDICTED_SHARE,
            "not printed; section 6 names places where the target is expected, and image borders",
        ),
        "prediction: mean velocity over positions, and its limit per axis [Hx/frame]": (
            (motion.N_REMEMBERED, motion.MAX_SPEED),
            "not printed; the mean over many frames is smoother than the state's velocity",
        ),
        "positions that count for the prediction": (
            "those with ρ of the mean state above (1 + threshold) / 2",
            "not printed; half-way between the threshold of eq. 15 and the largest ρ",
        ),
        "deviations of predicted particles in x and y, growth in x per lost frame, limit [Hx]": (
            (*motion.PREDICTED_SPREAD, motion.SPREAD_GROWTH, motion.MAX_SPREAD),
            "not printed; the prediction becomes less certain, mostly across",
        ),
        "deviation of the logarithm of the size of predicted particles": (
            motion.SIZE_SPREAD,
            "not printed; one factor for both half axes",
        ),
        "boxes in which the other particles of a lost target are placed": (
            "left and right border, at the last y",
            "section 6 names doors and image borders; doors are not known",
        ),
        "estimate while the target is lost": (
            "last box, not visible",
            "section 6 does not say what the tracker returns",
        ),
    }
    Parameters = Nummiaro2003Parameters

    _particles: Array
    _weights: Array
    _mean: Array
    _model: target_model.TargetModel
    _background: target_model.Background
    _threshold: float

    def __init__(self, parameters: Nummiaro2003Parameters, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        self._colours = JointBins(parameters.colour, parameters.bins)
        self._ellipses = target_model.EllipseHistograms(self._colours, parameters.kernel)
        self._likelihood = target_model.Likelihood(
            parameters.sigma, parameters.update_reading, parameters.update_threshold
        )
        self._watched: Image | None = None
        self._detector: Callable[[Image], Array] | None = None

    def watch(self, image: Image) -> None:
        """Store a frame without the target; the next initialisation uses it as background."""
        self._watched = image.copy()

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if the box has no area or is mostly outside."""
        watched, self._watched = self._watched, None
        if not (box[2] > 0 and box[3] > 0):
            raise TrackerError(
                f"nummiaro2003: the box {box.tolist()} has no area. Use another box."
            )
        mean = motion.ellipse_in(box)
        model = self._ellipses.histogram(frame, mean)
        if model is None:
            raise TrackerError(
                "nummiaro2003: less than a quarter of the ellipse of the box "
                f"{np.round(box, 1).tolist()} is inside the image. Use another box."
            )
        empty = None if watched is None else SharedFrame(watched)
        self._begin(frame, model, mean, empty, tracking=True)

    def init_by_histogram(
        self, image: Image, histogram: Array, half_axes: Array, regions: Array | None = None
    ) -> None:
        """Initialise by a histogram in a frame without the target, and wait until it enters.

        Parameters
        ----------
        image : ndarray of uint8, shape (height, width, 3)
            Frame without the target, BGR.
        histogram : ndarray of float64, shape (bins,)
            Target model, for example from `histogram_of`.
        half_axes : ndarray of float64, shape (2,)
            Hx and Hy of the entering target [pixels].
        regions : ndarray of float64, shape (k, 4), or None
            Boxes for the centre of the entering target [pixels]; by default at the left and the
            right border, at half the image's height.

        Raises
        ------
        TrackerError
            For an invalid histogram, half axes or regions.
        """
        self._watched = None
        model, bins = np.array(histogram, float), self._colours.n_bins
        if model.shape != (bins,) or not ((model >= 0).all() and np.isclose(model.sum(), 1.0)):
            raise TrackerError(
                f"nummiaro2003: the histogram has shape {model.shape} and sum {model.sum():g}. "
                f"Expected: {bins} values ≥ 0 of sum 1, as `histogram_of` returns them."
            )
        sizes = np.array(half_axes, float)
        if sizes.shape != (2,) or not ((sizes > 0) & np.isfinite(sizes)).all():
            raise TrackerError(
                f"nummiaro2003: invalid half_axes {half_axes}. Expected: two lengths above 0."
            )
        height, width = image.shape[:2]
        box = np.array([width, height, 0.0, 0.0]) / 2 + np.array([*-sizes, *(2 * sizes)])
        frame = SharedFrame(image)
        self._begin(frame, model, motion.ellipse_in(box), frame, tracking=False, regions=regions)

    def init_by_detector(self, image: Image, detector: Callable[[Image], Array]) -> None:
        """Initialise by the first detection, in this frame or a later one.

        `detector` maps a BGR image to boxes (k, 4) [pixels], best first; k may be 0. Boxes that are
        mostly outside the image are ignored. Before the first detection, the estimate is the whole
        image, not visible, without details. `trackers.detection` provides detectors.
        """
        self._detector = detector
        self._detect(image)

    def histogram_of(self, image: Image, box: Box) -> Array:
        """Return the histogram of the ellipse in a box, shape (bins,), of sum 1.

        Raises TrackerError if less than a quarter of the ellipse is in the image.
        """
        model = self._ellipses.histogram(
            SharedFrame(image), motion.ellipse_in(np.asarray(box, float))
        )
        if model is not None:
            return model
        raise TrackerError(
            f"nummiaro2003: less than a quarter of the ellipse in the box {box} is in the image. "
            "Use another box."
        )

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        if self._detector is not None:
            return self._detect(frame.image)
        self._frame += 1
        if self._tracking:
            self._select_and_propagate(frame)
        else:
            self._place_particles()
        ellipse_counts = self._ellipses.counts(frame, self._particles, self._model.bins)
        similarities = coefficients = self._model.coefficients(ellipse_counts)
        if self.parameters.appearance == "first":
            similarities = self._model.first_coefficients(ellipse_counts)
        self._weights = normalise_log_weights(self._likelihood.log(coefficients))
        positive = int(np.count_nonzero(similarities > self._threshold))
        self._switch(positive)
        if self._tracking:
            self._mean = mean_state(self._weights, self._particles)
        histogram = self._ellipses.histogram(frame, self._mean)
        coefficient = 0.0
        if histogram is not None:
            coefficient = min(float(np.sqrt(histogram * self._model.current).sum()), 1.0)
        likelihood = float(np.exp(self._likelihood.log(coefficient)))
        threshold, updated = self._threshold, 0.0
        if self._tracking:
            self._record_location(positive, coefficient)
        if self._tracking and self.parameters.model_update:
            minimum = self._likelihood.least_coefficient
            updated = self._model.update(
                histogram, coefficient, ellipse_counts, self._weights, minimum
            )
            if updated and self.parameters.appearance == "current":
                self._threshold = self._background.threshold(self._model.current)
        return Estimate(
            motion.box_around(self._mean),
            visible=self._tracking and coefficient > 0.0,
            confidence=likelihood,
            details={
                "positive_appearances": float(positive),
                "mode": float(self._tracking),
                "half_width": float(self._mean[4]),
                "half_height": float(self._mean[5]),
                "coefficient": coefficient,
                "likelihood": likelihood,
                "updated": updated,
                "appearance_threshold": threshold,
            },
            arrays={"particles": self._particles, "weights": self._weights},
        )

    def _begin(
        self,
        frame: SharedFrame,
        model: Array,
        mean: Array,
        background_frame: SharedFrame | None,
        *,
        tracking: bool,
        regions: Array | None = None,
    ) -> None:
        """Initialise the state; `background_frame` does not contain the target."""
        parameters = self.parameters
        self._generator = np.random.default_rng(self.seed)
        self._detector = None
        height, width = frame.image.shape[:2]
        self._image_size = width, height
        self._frame, self._n_few, self._tracking = 0, 0, tracking
        self._mean, self._aspect = mean, float(mean[5] / mean[4])
        self._particles = np.tile(mean, (parameters.particles, 1))
        self._rates = np.zeros((parameters.particles, 3))
        self._weights = normalise_log_weights(np.zeros(parameters.particles))
        apart = parameters.models == "per-particle"
        self._model = target_model.TargetModel(model, parameters.particles, apart, parameters.alpha)
        self._locations = motion.LocationMemory(mean[4:6], self._image_size, regions)
        if tracking:
            self._locations.record_probable(mean[:2], mean[4:6])
            self._locations.record_certain(0, mean[:2])
        self._background = target_model.Background(
            background_frame or frame,
            mean[4:6],
            target_model.grid_spacing(parameters.background_positions, mean[4:6], self._image_size),
            self._colours,
            parameters.kernel,
            mean[:2] if background_frame is None else None,
        )
        self._threshold = self._background.threshold(model)

    def _detect(self, image: Image) -> Estimate:
        """Run the detector and start tracking at its first usable box, if any."""
        assert self._detector is not None
        height, width = image.shape[:2]
        boxes = np.asarray(self._detector(image), float)
        if boxes.size % 4:
            raise TrackerError(
                f"nummiaro2003: the detector returned {boxes!r}. Expected: boxes of shape (k, 4)."
            )
        for box in boxes.reshape(-1, 4):
            ellipse = motion.ellipse_in(box)
            if self._ellipses.histogram(SharedFrame(image), ellipse) is not None:
                self.init(image, box)
                return Estimate(motion.box_around(ellipse))
        return Estimate(np.array([0.0, 0.0, width, height]), visible=False)

    def _select_and_propagate(self, frame: SharedFrame) -> None:
        """Resample and propagate the particles (steps 1 and 2 of Fig. 1)."""
        indices = multinomial(self._weights, self._generator.random(len(self._weights)))
        self._model.select(indices)
        self._particles, self._rates = motion.propagate(
            self.parameters,
            self._particles[indices],
            self._rates[indices],
            float(self._mean[4]),
            self._aspect,
            self._image_size,
            self._generator,
        )

    def _place_particles(self) -> None:
        """Place the particles for a frame of initialisation."""
        parameters = self.parameters
        self._particles = self._locations.particles(
            parameters.placement, parameters.particles, self._frame, self._generator
        )
        self._rates[:] = 0.0
        self._model.reset()

    def _switch(self, positive: int) -> None:
        """Switch between initialisation and tracking (section 6)."""
        needed = self.parameters.kick_off * self.parameters.particles
        if not self._tracking:
            self._tracking = positive > needed
        elif self.parameters.reinitialise:
            self._n_few = self._n_few + 1 if positive < needed else 0
            if self._n_few >= self.parameters.loss_frames:
                self._tracking, self._n_few = False, 0

    def _record_location(self, positive: int, coefficient: float) -> None:
        """Store the target's position, for a search after a later loss."""
        if positive > self.parameters.particles / 2:
            self._locations.record_probable(self._mean[:2], self._mean[4:6])
        if coefficient > (1 + self._threshold) / 2:
            self._locations.record_certain(self._frame, self._mean[:2])
