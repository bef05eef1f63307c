"""Cue of the target's contour (section 4.3)."""

from math import ceil, floor, inf, sqrt
from typing import Any

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.kalman import ConstantVelocity
from trackmark.trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackmark.trackers.contours.observation import (
    Observation,
    Rectangle,
    weights_from_scores,
)
from trackmark.trackers.contours.outline import contour_scores

MIN_AREA = 60  # minimum number of pixels inside a contour
REFERENCE_WIDTH = 320  # image width to which distances in the parameters refer [pixels]


class ContourCue(ParticleCue):
    """Particle filter of contours (points, 2) [pixels].

    The dynamic model is r = m + H (r' - m) + p, where m is the mean of the points of r'. (The paper
    applies H to image coordinates. A change of size would then displace a target far from the image
    corner.) The `parameters` are those of a `Segmenter`.

    A contour's score is the mean posterior of the target inside minus the mean outside (section
    5.4), for the attached mixtures. "Outside" is the rest of the image, or of the bounding box of
    the window and all contours. (If the target is small, the mean over the image hardly depends on
    the contour.)

    `anchors` (k, points, 2) are contours that replace the first k particles before propagation.
    Initially there are none.
    """

    def __init__(self, start: Array, parameters: Any, image_width: int) -> None:
        super().__init__(start, parameters.contour_samples)
        self.parameters = parameters
        self.affine = np.array(
            [
                [parameters.stretch_x_spread, parameters.shear_x_spread],
                [parameters.shear_y_spread, parameters.stretch_y_spread],
            ]
        )
        shift = np.array([parameters.shift_x_spread, parameters.shift_y_spread])
        self.shift = shift * image_width / REFERENCE_WIDTH
        self.anchors = self.states[:0]

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        deformed = self.deform(states, generator)
        return deformed + generator.normal(size=(len(states), 1, 2)) * self.shift

    def deform(self, states: Array, generator: np.random.Generator) -> Array:
        """Return contours (n, points, 2) deformed by H about their means, a new array."""
        states[: len(self.anchors)] = self.anchors
        maps = np.eye(2) + generator.normal(size=(len(states), 2, 2)) * self.affine
        centres = states.mean(axis=1, keepdims=True)
        around = states - centres
        # Written out, because NumPy's matrix products are slower for 2 x 2 matrices.
        deformed: Array = np.empty_like(around)
        for axis in (0, 1):
            along, across = maps[:, axis, :1], maps[:, axis, 1:]
            deformed[..., axis] = along * around[..., 0] + across * around[..., 1]
        deformed += centres
        return deformed

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`; uses posteriors of the previous cue. The score is the evidence."""
        assert attached is not None, "a colour cue precedes the contour cue in the chain"
        cells = observation.cells
        height, width = cells.image.shape
        scores = contour_scores(
            earlier[-1].evidence,
            cells.image,
            attached,
            states,
            _bounding_window(observation.window, states, width, height),
            self.parameters.outside,
            MIN_AREA,
        )
        weights = weights_from_scores(
            scores, self.parameters.weights, self.parameters.contour_temperature
        )
        return Weighed(weights, scores)


class KalmanContourCue(ContourCue):
    """Contour cue with particles for the shape and a Kalman filter for the position.

    Positions are drawn from the Kalman filter's prediction. The measurement is chosen such that the
    corrected state has the mean and variance of the weighted contours.
    """

    def __init__(self, start: Array, parameters: Any, image_width: int) -> None:
        super().__init__(start, parameters, image_width)
        # An acceleration a moves the target by a / 2 in one frame.
        noise = 2 * sqrt(float(np.mean(self.shift**2)))
        self.motion = ConstantVelocity(start.mean(axis=0), self.shift, noise)

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        shapes = self.deform(states, generator)
        self.motion.predict()
        spread = np.sqrt(self.motion.covariances[:, 0, 0])
        positions = self.motion.position + generator.normal(size=(len(states), 2)) * spread
        placed: Array = shapes + (positions - shapes.mean(axis=1))[:, np.newaxis]
        return placed

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`."""
        super().receive(states, weights)
        centres = states.mean(axis=1)
        mean = weights @ centres
        variance = weights @ (centres - mean) ** 2
        before, predicted = self.motion.covariances[:, 0, 0], self.motion.position
        measured, deviations = predicted.copy(), np.full(2, inf)
        # Weights that do not reduce the variance contain no measurement.
        informative = variance < before
        gains = 1 - variance[informative] / before[informative]
        measured[informative] += (mean - predicted)[informative] / gains
        deviations[informative] = np.sqrt(before[informative] * (1 - gains) / gains)
        self.motion.correct(measured, deviations)


def _bounding_window(window: Rectangle, contours: Array, width: int, height: int) -> Rectangle:
    """Return the bounding box of a window and contours, clipped to the image."""
    x, y = contours[..., 0], contours[..., 1]
    return (
        max(min(window[0], floor(x.min())), 0),
        max(min(window[1], floor(y.min())), 0),
        min(max(window[2], ceil(x.max())), width),
        min(max(window[3], ceil(y.max())), height),
    )
