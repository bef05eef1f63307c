"""The target's contour, as a cue (section 4.3)."""

from dataclasses import dataclass
from math import ceil, floor, inf, sqrt
from typing import Any

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.kalman import ConstantVelocity
from trackmark.trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackmark.trackers.contours.observation import (
    Observation,
    Rectangle,
    Weights,
    weights_from_scores,
)
from trackmark.trackers.contours.outline import Outside, contour_scores

MIN_AREA = 60  # pixels; a contour around fewer is no hypothesis


@dataclass(frozen=True, slots=True)
class ContourDynamics:
    """How contours go on: r = m + H (r' - m) + p, m being the mean of the points of r'.

    The paper applies H to the coordinates themselves; about the image's corner a change of size
    would move a target far from it.
    """

    affine: Array  # (2, 2): deviations of the elements of H, whose mean is the identity
    shift: Array  # (2,): those of p [pixels]

    def deformed(self, states: Array, generator: np.random.Generator) -> Array:
        """Contours about their means, which stay: shape (n, points, 2), fresh."""
        maps = np.eye(2) + generator.normal(size=(len(states), 2, 2)) * self.affine
        centres = states.mean(axis=1, keepdims=True)
        around = states - centres
        # A product of matrices by hand: they are so small that all else is dearer.
        deformed: Array = np.empty_like(around)
        for axis in (0, 1):
            along, across = maps[:, axis, :1], maps[:, axis, 1:]
            deformed[..., axis] = along * around[..., 0] + across * around[..., 1]
        deformed += centres
        return deformed

    def shifts(self, count: int, generator: np.random.Generator) -> Array:
        """Draws of p, shape (count, 1, 2), in pixels."""
        return generator.normal(size=(count, 1, 2)) * self.shift


class ContourCue(ParticleCue):
    """Contours (points, 2) as particles [pixels].

    A contour's weight says how much higher the posterior of the target is inside than outside
    (section 5.4), on the map of the attached mixtures. "Outside" is the rest of the image, or of
    the bounding box of the window and all contours (beyond a small target, the mean over the image
    hardly changes with a contour). `weights` and `temperature` are those of `weights_from_scores`.

    `anchors` (k, points, 2) are contours that replace the first k particles before propagation;
    none at first.
    """

    def __init__(
        self,
        start: Array,
        count: int,
        dynamics: ContourDynamics,
        outside: Outside,
        weights: Weights,
        temperature: float,
    ) -> None:
        super().__init__(start, count)
        self.dynamics = dynamics
        self.outside: Outside = outside
        self.grading: tuple[Weights, float] = weights, temperature
        self.anchors = self.states[:0]

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        states[: len(self.anchors)] = self.anchors
        moved = self.dynamics.deformed(states, generator)
        return moved + self.dynamics.shifts(len(states), generator)

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`, after a cue of posteriors; the evidence is the difference itself."""
        if attached is None:
            raise ValueError("contours are judged on a posterior: a cue of colours comes before")
        cells = observation.cells
        height, width = cells.image.shape
        scores = contour_scores(
            earlier[-1].evidence,
            cells.image,
            attached,
            states,
            _around(observation.window, states, width, height),
            self.outside,
            MIN_AREA,
        )
        return Weighed(weights_from_scores(scores, *self.grading), scores)


class KalmanContourCue(ContourCue):
    """Contours whose shapes are particles, and whose place is a Kalman filter's.

    In each frame the places are drawn from the filter's prediction. It is corrected by the
    measurement that would take its prediction to the mean and variance of the weighted contours.
    """

    def __init__(self, start: Array, count: int, dynamics: ContourDynamics, *judging: Any) -> None:
        super().__init__(start, count, dynamics, *judging)
        # An acceleration a moves a target by a / 2 in its first frame.
        noise = 2 * sqrt(float(np.mean(dynamics.shift**2)))
        self.place = ConstantVelocity(start.mean(axis=0), dynamics.shift, noise)

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        states[: len(self.anchors)] = self.anchors
        shapes = self.dynamics.deformed(states, generator)
        self.place.predict()
        spread = np.sqrt(self.place.covariances[:, 0, 0])
        places = self.place.position + generator.normal(size=(len(states), 2)) * spread
        placed: Array = shapes + (places - shapes.mean(axis=1))[:, np.newaxis]
        return placed

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`."""
        super().receive(states, weights)
        centres = states.mean(axis=1)
        mean = weights @ centres
        variance = weights @ (centres - mean) ** 2
        before, predicted = self.place.covariances[:, 0, 0], self.place.position
        measured, deviations = predicted.copy(), np.full(2, inf)
        # Weights that leave the spread as it was, or widen it, have measured nothing.
        told = variance < before
        gains = 1 - variance[told] / before[told]
        measured[told] += (mean - predicted)[told] / gains
        deviations[told] = np.sqrt(before[told] * (1 - gains) / gains)
        self.place.correct(measured, deviations)


def _around(window: Rectangle, contours: Array, width: int, height: int) -> Rectangle:
    """Bounding box of a window and contours, in the image."""
    x, y = contours[..., 0], contours[..., 1]
    return (
        max(min(window[0], floor(x.min())), 0),
        max(min(window[1], floor(y.min())), 0),
        min(max(window[2], ceil(x.max())), width),
        min(max(window[3], ceil(y.max())), height),
    )
