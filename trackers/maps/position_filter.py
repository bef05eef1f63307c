"""Particle filter of window positions on the joint map (Wang & Tang 2010, section 2.3)."""

from collections.abc import Mapping
from math import sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness
from trackmark.trackers.base.parameters import choice, chosen, integer, positive, printed
from trackmark.trackers.base.particles import (
    SCHEMES,
    effective_sample_size,
    mean_state,
    normalise_log_weights,
)
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.maps.back_projection import window_size
from trackmark.trackers.maps.joint_map import CHOICES, ColourMotionModel, ColourMotionParameters

RECOMMENDED = {"sigma": 0.158}
"""Value of the preset `recommended`: exp(-20 D²) of Pérez et al. (ECCV 2002)."""


class PositionFilterParameters(ColourMotionParameters):
    """Parameters of `PositionFilter`."""

    particles: int = integer(
        60, "number of particles N [count]", maximum=100_000, origin=printed("Table 1: N = 60")
    )
    radius: Annotated[float, Field(ge=0.0)] | Literal["rule"] = choice(
        "rule",
        "r: maximum random displacement of a particle per axis; rule: √N / 2 [pixels]",
        origin=printed("eq. 8: r = √N / 2"),
    )
    sigma: float = positive(
        1.0,
        "σ of the likelihood, by which D is divided [ratio]",
        origin=printed("eq. 10: exp(-D² / 2), without a scale"),
    )
    resampling: Literal["systematic", "multinomial"] = choice(
        "systematic",
        "resampling scheme",
        origin=chosen(
            "section 2.3, step 5 names resampling, without a scheme; this one has the least "
            "variance"
        ),
    )
    velocity: Literal["particle", "mean"] = choice(
        "particle",
        "last step by which a particle moves: its own, or the mean of all particles",
        origin=printed("eq. 8: s_(k-1) - s_(k-2) of each particle"),
    )
    estimate: Literal["mean", "resampled", "best"] = choice(
        "mean",
        "mean: weighted mean of the particles; resampled: mean of the resampled particles; best: "
        "the particle of the largest weight",
        origin=chosen(
            "eq. 12 is a weighted sum; after resampling, as section 2.3 orders, all weights are "
            "equal"
        ),
    )


class PositionFilter(SharingTracker):
    """Base class of particle filters whose particles are window positions.

    A particle's weight is computed from the joint map in the window. A subclass defines its `name`
    (for error messages) and, by `drift_rule`, the mean shift of particles before weighting.
    """

    name: ClassVar[str]

    randomness = Randomness.GENERATOR
    presets = {"as-written": {}, "recommended": RECOMMENDED}
    choices = {
        **CHOICES,
        "steps s_(k-1) - s_(k-2) after resampling": (
            "copied with the particle",
            "eq. 8 needs both positions of one particle",
        ),
        "first positions": (
            "the init box, displaced by r u",
            "section 2.3, step 1: near the initial state, without a distribution",
        ),
        "first velocity s_(k-1) - s_(k-2)": (
            0.0,
            "eq. 8 needs two earlier positions, and the first frame has one; not stated",
        ),
        "limits of predicted positions": ("pixel centres of the image", "not stated"),
    }

    def drift_rule(self) -> tuple[float, int]:
        """Return stop distance [pixels] and maximum iterations (0: none) of mean shift."""
        return 0.0, 0

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError as `ColourMotionModel` does."""
        parameters = self.parameters
        centre, self._box_size = box[:2] + box[2:] / 2, box[2:].copy()
        self._window = window_size(box)
        self._model = ColourMotionModel(self.name, parameters, frame, centre, self._window)
        n = parameters.particles
        self._radius = sqrt(n) / 2 if parameters.radius == "rule" else parameters.radius
        self._generator = np.random.default_rng(self.seed)
        self._positions = centre + self._draw_displacements()
        self._steps = np.zeros((n, 2))

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; raise TrackerError if the frame size changes."""
        parameters, window = self.parameters, self._window
        joint = self._joint = self._model.observe(frame)
        predicted = self._predict(frame.image.shape)
        moved = joint.drift(predicted, window, *self.drift_rule())
        similarity = moved.after * joint.unit / (window[0] * window[1])
        weights = normalise_log_weights(
            (similarity - 1) / (2 * parameters.sigma**2)
        )  # equations 9 to 11
        indices = SCHEMES[parameters.resampling](weights, self._uniforms())
        estimate = self._mean_position(weights, moved.points, indices)
        steps = moved.points - self._positions
        self._positions, self._steps = moved.points[indices], steps[indices]
        details = self._particle_details(weights, moved.points)
        details["iterations"] = float(moved.iterations.mean())
        details |= joint.details(estimate, window)
        return Estimate(
            np.concatenate([estimate - self._box_size / 2, self._box_size]),
            visible=details["similarity"] > 0,
            confidence=details["similarity"],
            details=details,
            arrays={
                "particles": moved.points,
                "predicted": predicted,
                "weights": weights,
                "similarity": similarity,
                "predicted_similarity": moved.before * joint.unit / (window[0] * window[1]),
            },
        )

    def maps(self, image: Image) -> Mapping[str, Array]:
        """Return the joint map of colour and motion; see `WeightMapTracker.maps`."""
        return {"joint map": self._joint.full_map()}

    def _draw_displacements(self) -> Array:
        """Draw the displacements r u of equation 8, independently for x and y."""
        return self._radius * self._generator.uniform(-1.0, 1.0, (self.parameters.particles, 2))

    def _predict(self, image_shape: tuple[int, ...]) -> Array:
        """Predict positions by equation 8, clipped to the image's pixel centres."""
        steps = self._steps
        if self.parameters.velocity == "mean":
            steps = steps.mean(axis=0)
        last_pixel = np.array([image_shape[1] - 0.5, image_shape[0] - 0.5])
        carried = self._positions + steps + self._draw_displacements()
        inside: Array = np.minimum(np.maximum(carried, 0.5), last_pixel)
        return inside

    def _uniforms(self) -> Array:
        """Draw random numbers for resampling; systematic resampling uses one only."""
        n: int = self.parameters.particles
        if self.parameters.resampling == "systematic":
            return np.full(n, self._generator.random())
        return self._generator.random(n)

    def _mean_position(self, weights: Array, points: Array, indices: NDArray[np.intp]) -> Array:
        """Return the estimated position (2,) by an interpretation of equation 12."""
        match self.parameters.estimate:
            case "mean":
                estimate = mean_state(weights, points)
            case "resampled":
                estimate = points[indices].mean(axis=0)
            case _:
                estimate = points[weights.argmax()]
        return estimate

    def _particle_details(self, weights: Array, points: Array) -> dict[str, float]:
        """Return statistics of the particles; see the details of `wang2010`."""
        n = len(points)
        apart = (points - points.sum(axis=0) / n).ravel()
        pixels = points.astype(np.int64)
        return {
            "effective_sample_size": effective_sample_size(weights) / n,
            "weight_ratio": float(weights.max()) * n,
            "spread": sqrt(apart @ apart / n),
            "modes": float(len(set((pixels[:, 0] << 32 | pixels[:, 1]).tolist()))),
        }
