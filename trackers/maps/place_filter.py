"""A particle filter over places on the joint map (Wang & Tang 2010, section 2.3)."""

from collections.abc import Mapping
from math import sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness
from trackmark.trackers.base.parameters import choice, positive, whole
from trackmark.trackers.base.particles import SCHEMES, effective_number, mean_state, normalised
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.maps.back_projection import whole_window
from trackmark.trackers.maps.joint_map import ColourMotionModel, ModelParameters

ROBUST = {"sigma": 0.1, "radius": 10.0, "difference_window": 7}
"""What the preset `robust` of every filter of places has (post hoc)."""


class CloudParameters(ModelParameters):
    """Parameters of `PlaceFilter`."""

    particles: int = whole(60, "number of particles N [count]", most=100_000)
    radius: Annotated[float, Field(ge=0.0)] | Literal["rule"] = choice(
        "rule", "r: a particle is thrown at most so far either way; rule: √N / 2 [pixels]"
    )
    sigma: float = positive(0.158, "scale of D in the observation function, 1 as printed [ratio]")
    resampling: Literal["systematic", "multinomial"] = choice(
        "systematic", "how particles are chosen by their weights"
    )
    velocity: Literal["particle", "mean"] = choice(
        "particle", "what carries a particle on: its own last step, or the mean of all"
    )
    estimate: Literal["mean", "resampled", "best"] = choice(
        "mean",
        "mean: of the weighted particles; resampled: of those that go on; best: the "
        "particle of the largest weight",
    )


class PlaceFilter(SharingTracker):
    """Particles that are places of a window of one size, weighed by the joint map inside it.

    A subclass says its `name`, for messages, and in `drift_rule` how far each particle climbs
    before it is weighed.
    """

    name: ClassVar[str]

    randomness = Randomness.GENERATOR

    def drift_rule(self) -> tuple[float, int]:
        """Stop distance (pixels) and most iterations of every particle's mean shift; 0 for none."""
        return 0.0, 0

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`, and `ColourMotionModel` for what is refused."""
        settings = self.parameters
        centre, self._box_size = box[:2] + box[2:] / 2, box[2:].copy()
        self._window = whole_window(box)
        self._model = ColourMotionModel(self.name, settings, frame, centre, self._window)
        n = settings.particles
        self._radius = sqrt(n) / 2 if settings.radius == "rule" else settings.radius
        self._generator = np.random.default_rng(self.seed)
        self._places = centre + self._thrown()
        self._steps = np.zeros((n, 2))

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; raises TrackerError for a frame of another size than the first."""
        settings, window = self.parameters, self._window
        joint = self._joint = self._model.observe(frame)
        predicted = self._predicted(frame.image.shape)
        moved = joint.drift(predicted, window, *self.drift_rule())
        similarity = moved.after * joint.unit / (window[0] * window[1])
        weights = normalised((similarity - 1) / (2 * settings.sigma**2))  # equations 9 to 11
        chosen = SCHEMES[settings.resampling](weights, self._uniforms())
        estimate = self._estimated(weights, moved.points, chosen)
        steps = moved.points - self._places
        self._places, self._steps = moved.points[chosen], steps[chosen]
        details = self._spread(weights, moved.points)
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
        """See `Mapper.maps`: the joint map of colour and motion."""
        return {"joint map": self._joint.whole()}

    def _thrown(self) -> Array:
        """Draw r u of equation 8, both coordinates apart."""
        return self._radius * self._generator.uniform(-1.0, 1.0, (self.parameters.particles, 2))

    def _predicted(self, image_shape: tuple[int, ...]) -> Array:
        """Equation 8; a particle carries on as it went, and stays on the image's pixels."""
        steps = self._steps
        if self.parameters.velocity == "mean":
            steps = steps.mean(axis=0)
        last_pixel = np.array([image_shape[1] - 0.5, image_shape[0] - 0.5])
        carried = self._places + steps + self._thrown()
        inside: Array = np.minimum(np.maximum(carried, 0.5), last_pixel)
        return inside

    def _uniforms(self) -> Array:
        """Numbers for the resampling; the systematic one looks at a single one."""
        n: int = self.parameters.particles
        if self.parameters.resampling == "systematic":
            return np.full(n, self._generator.random())
        return self._generator.random(n)

    def _estimated(self, weights: Array, points: Array, chosen: NDArray[np.intp]) -> Array:
        """Equation 12 and its readings."""
        match self.parameters.estimate:
            case "mean":
                found = mean_state(weights, points)
            case "resampled":
                found = points[chosen].mean(axis=0)
            case _:
                found = points[weights.argmax()]
        return found

    def _spread(self, weights: Array, points: Array) -> dict[str, float]:
        """What became of the particles; see the details of `wang2010`."""
        n = len(points)
        apart = (points - points.sum(axis=0) / n).ravel()
        pixels = points.astype(np.int64)
        return {
            "effective_sample_size": effective_number(weights) / n,
            "weight_ratio": float(weights.max()) * n,
            "spread": sqrt(apart @ apart / n),
            "modes": float(len(set((pixels[:, 0] << 32 | pixels[:, 1]).tolist()))),
        }
