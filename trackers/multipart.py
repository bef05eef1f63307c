"""Particle filter on colour histograms of a rectangle or of its two halves, chosen at the start."""

from math import inf, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Box, Estimate, Mask, Randomness
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    choice,
    chosen,
    fraction,
    integer,
    positive,
    printed,
)
from trackmark.trackers.base.particles import (
    SCHEMES,
    effective_sample_size,
    mean_state,
    normalise_log_weights,
)
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.histograms.bins import N_BINS, Binning, LuvBins, UvRange
from trackmark.trackers.histograms.counting import count_regions
from trackmark.trackers.histograms.rectangles import Regions, bhattacharyya_distances, pixel_regions

__all__ = ["Multipart"]

# minimum part inside the image; otherwise the weight is 0
MIN_SHARE, MIN_PIXELS = 0.25, 16
LARGEST_CHANGE = 25.0  # maximum factor between the area and the first area


class MultipartParameters(Parameters):
    """Parameters of `Multipart`."""

    representation: Literal["adaptive", "single", "multi"] = choice(
        "adaptive",
        "single: one histogram of the rectangle; multi: one histogram per half; adaptive: choice "
        "by the distance of the halves in the first frame",
        origin=printed("eq. 7: choice by the distance of the halves"),
    )
    particles: int = integer(
        200, "number of particles N [count]", origin=printed("section 3: N = 200")
    )
    position_divisor: float = positive(
        3.0,
        "a: the maximum noise of the centre is width / a [ratio]",
        origin=printed("section 3: a = 3"),
    )
    size_divisor: float = positive(
        10.0,
        "b: the maximum noise of the area is area / b [ratio]",
        origin=printed("section 3: b = 10"),
    )
    sigma: float = positive(
        0.1, "σ of the likelihood [histogram distance]", origin=printed("section 3: σ = 0.1")
    )
    threshold: float = fraction(
        0.4,
        "T: adaptive uses two parts if the distance of the halves exceeds T [histogram distance]",
        origin=printed("section 3: T = 0.4"),
    )
    binning: Binning = choice(
        "both",
        "both: a pixel votes for its L* bin and its u*v* bin; perez: only for its L* bin if it "
        "is nearly grey, otherwise only for its u*v* bin",
        origin=chosen("the page is missing; section 3 lists an L and a uv histogram"),
    )
    uv_range: UvRange = choice(
        "full",
        "range of the u*v* bins; full: u* -134 to 220 and v* -140 to 122; natural: u* -60 to 120 "
        "and v* -80 to 80; srgb-gamut: u* -83 to 175 and v* -134 to 107",
        origin=chosen("the page is missing; the range of all 8-bit colours"),
    )
    sigma_meaning: Literal["deviation", "variance"] = choice(
        "deviation",
        "meaning of sigma: standard deviation or variance of the Gaussian",
        origin=printed("eq. 8: exp(-d² / 2σ²), although the text calls σ a variance"),
    )
    noise_range: Literal["half", "total"] = choice(
        "half",
        "half: noise is within ± width/a and ± area/b; total: within half of these bounds",
        origin=chosen("eq. 6 prints a range, read as the largest noise in both directions"),
    )
    noise_size: Literal["mean", "sample"] = choice(
        "mean",
        "size that scales proportional noise: the last estimate's or each particle's",
        origin=chosen("eq. 6: the rectangle at time t - 1, either the estimate or the sample"),
    )
    dynamics: Literal["random-walk", "first-order"] = choice(
        "random-walk",
        "random-walk: noise changes the position; first-order: noise changes the velocity",
        origin=printed("eq. 5: random walk"),
    )
    noise: Literal["proportional", "fixed"] = choice(
        "proportional",
        "proportional: noise scales with the size; fixed: its range stays as in the first frame",
        origin=printed("eq. 6: noise by the rectangle's size"),
    )
    resampling: Literal["multinomial", "systematic", "stratified", "residual"] = choice(
        "multinomial",
        "resampling scheme",
        origin=printed("section 2.2: the algorithm of the paper's [1], Isard & Blake"),
    )


class Multipart(SharingTracker):
    """Particle filter on colour histograms of a rectangle or of its two halves.

    The state is the rectangle's centre and area; its aspect is that of the init box. Histograms
    have 10 bins of L* and 10 x 10 of u* and v*, without a kernel. In each frame, particles move by
    uniform noise (equations 5 and 6: ± width/a in x and y, ± area/b). Their weight is exp(-d²/2σ²),
    where d is the Bhattacharyya distance to the first frame's histogram (equations 1, 2 and 8). The
    estimate is the weighted mean (equation 4). Particles are then resampled. `adaptive` compares
    the upper and the lower half of the first rectangle. If their distance exceeds the threshold, it
    equals `multi`, otherwise `single`. (Equation 7 calls the distance of equation 1 a coefficient.)

    The paper's first page is missing. So these are our choices: L* and u*v* contribute half of the
    histogram each; the range of the bins; and the state's "scale" is an area, in the unit of
    equation 6. The text calls σ a variance, but prints it as a standard deviation. The weight of a
    rectangle is 0 if less than a quarter of it, or fewer than 16 of its pixels, are inside the
    image. Areas stay within a factor of 25 of the first.

    With `dynamics=first-order`, the centre has a velocity, and noise is added to the velocity
    instead of the position. The spread around the prediction equals that of the random walk. The
    area remains a random walk.

    The preset `robust` is for recorded video. Its values were selected one after the other on
    synthetic scenes and on the samples. No table shows results on these scenes.

    The box is the mean state, not rounded. Details: `part_distance` (between the halves of the
    first rectangle), `effective_particles` (1/Σπ²), `distance` (weighted mean of d) and
    `area_ratio` (area / first area). `confidence` is the likelihood of `distance`, in [0, 1]. If
    all weights are 0, the target is not visible and particles get equal weights. Arrays:
    `particles` (N, 3) before resampling: x, y [pixels], area [square pixels]; `weights` (N,).
    """

    paper = (
        "An adaptive colour-based particle filter that combines single-part and multi-part "
        "colour histograms (multi-part after Pérez et al., Color-based probabilistic tracking, "
        "ECCV 2002)"
    )
    randomness = Randomness.GENERATOR
    presets = {
        "as-written": {},
        "recommended": {},
        "robust": {
            "representation": "multi",
            "binning": "perez",
            "dynamics": "first-order",
            "position_divisor": 2.0,
            "size_divisor": 20.0,
        },
    }
    choices = {
        "meaning of the scale": ("area of the rectangle", "eq. 6 adds a product of two sides"),
        "aspect of the rectangle": ("that of the init box", "the state has one size"),
        "colours": (
            "8-bit L*u*v* of OpenCV",
            "the page is missing; section 3 names L and uv histograms",
        ),
        "minimum part of a rectangle in the image, below which its weight is 0": (
            MIN_SHARE,
            "not stated; a histogram of few pixels is noise",
        ),
        "minimum number of pixels of a rectangle in the image": (
            MIN_PIXELS,
            "not stated; a histogram of few pixels is noise",
        ),
        "maximum factor between the area and the first area": (
            LARGEST_CHANGE,
            "eq. 5 has no bound; an area must stay positive",
        ),
        "border between the halves": (
            "row ⌊(top + bottom) / 2⌋",
            "Fig. 1 shows two equal parts",
        ),
        "first particles": ("the init box", "not stated"),
    }
    Parameters = MultipartParameters

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if too little of the box is in the image."""
        parameters = self.parameters
        x, y, width, height = (float(value) for value in box)
        if not (width > 0 and height > 0):
            raise TrackerError(f"multipart: the box {box.tolist()} has no area. Use another box.")
        self._generator = np.random.default_rng(self.seed)
        self._colours = LuvBins(parameters.binning, parameters.uv_range)
        self._aspect = width / height
        self._first_area = width * height
        self._mean = np.array([x + width / 2, y + height / 2, self._first_area])
        halves = self._regions(frame, self._mean[np.newaxis], 2)
        if not halves.pixels.all():
            raise TrackerError(
                f"multipart: too little of the box {np.round(box, 1).tolist()} is in the image. "
                f"Needed: a quarter of it, {MIN_PIXELS} pixels and two rows. Use another box."
            )
        every = np.arange(N_BINS)
        counts = count_regions(frame, halves, self._colours, every)[:, 0]
        totals = halves.pixels[:, 0] * self._colours.votes_a_pixel
        self._part_distance = float(
            bhattacharyya_distances(counts[:1], totals[:1], counts[1], totals[1])[0]
        )
        self._n_parts = {"single": 1, "multi": 2}.get(
            parameters.representation, 2 if self._part_distance > parameters.threshold else 1
        )
        if self._n_parts == 1:
            counts, totals = counts.sum(axis=0, keepdims=True), totals.sum(keepdims=True)
        # Empty bins of the reference contribute 0 to a coefficient.
        self._bins = np.flatnonzero(counts.any(axis=0))
        self._reference = np.ascontiguousarray(counts[:, self._bins].astype(np.int32))
        self._reference_totals = totals.tolist()
        self._states = np.tile(self._mean, (parameters.particles, 1))
        self._velocities = np.zeros_like(self._states)

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`."""
        self._propagate()
        distances, pixels = self._distances(frame)
        log_weights = np.where(pixels > 0, self._log_likelihood(distances), -inf)
        weights = normalise_log_weights(log_weights)
        self._mean = mean_state(weights, self._states)
        distance = min(float(weights @ distances), 1.0)
        estimate = Estimate(
            self._box(),
            visible=bool(pixels.any()),
            confidence=float(np.exp(self._log_likelihood(distance))),
            details={
                "part_distance": self._part_distance,
                "effective_particles": effective_sample_size(weights),
                "distance": distance,
                "area_ratio": float(self._mean[2] / self._first_area),
            },
            arrays={"particles": self._states, "weights": weights},
        )
        uniforms = self._generator.random(len(weights))
        indices = SCHEMES[self.parameters.resampling](weights, uniforms)
        self._states = self._states[indices]
        self._velocities = self._velocities[indices]
        return estimate

    def _propagate(self) -> None:
        """Move the particles; noise is added to positions or velocities (equations 5 and 6)."""
        parameters = self.parameters
        if parameters.noise == "fixed":
            area: Any = self._first_area
        elif parameters.noise_size == "sample":
            area = self._states[:, 2]
        else:
            area = self._mean[2]
        position = np.sqrt(area * self._aspect) / parameters.position_divisor
        half_range = np.array([position, position, area / parameters.size_divisor]).T
        if parameters.noise_range == "total":
            half_range = half_range / 2
        steps = (2.0 * self._generator.random(self._states.shape) - 1.0) * half_range
        if parameters.dynamics == "first-order":
            steps = self._velocities + steps
            self._velocities = steps * [1.0, 1.0, 0.0]  # the area is a random walk
        self._states = self._states + steps
        minimum, maximum = self._first_area / LARGEST_CHANGE, self._first_area * LARGEST_CHANGE
        np.clip(self._states[:, 2], minimum, maximum, out=self._states[:, 2])

    def _distances(self, frame: SharedFrame) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return each particle's distance and number of pixels (0 if mostly outside the image)."""
        regions = self._regions(frame, self._states, self._n_parts)
        counts = count_regions(frame, regions, self._colours, self._bins)
        total = np.zeros(len(self._states))
        for part_index, reference in enumerate(self._reference):
            total += bhattacharyya_distances(
                counts[part_index],
                regions.pixels[part_index] * self._colours.votes_a_pixel,
                reference,
                self._reference_totals[part_index],
            )
        return total / self._n_parts, regions.pixels.sum(axis=0)

    def _log_likelihood(self, distance: Any) -> Any:
        """Return the logarithm of equation 8 without its constant factor."""
        sigma = self.parameters.sigma
        variance = sigma if self.parameters.sigma_meaning == "variance" else sigma**2
        return -(distance**2) / (2 * variance)

    def _regions(self, frame: SharedFrame, states: NDArray[np.float64], n_parts: int) -> Regions:
        height, width = frame.image.shape[:2]
        return pixel_regions(states, self._aspect, n_parts, width, height, MIN_SHARE, MIN_PIXELS)

    def _box(self) -> Box:
        x, y, area = self._mean.tolist()
        width = sqrt(area * self._aspect)
        height = area / width
        return np.array([x - width / 2, y - height / 2, width, height])
