"""Kalman filters of a point that keeps its velocity but for noise.

One is of several axes at a time, whose measurements may say nothing; one is of a single number.
Their sums run in different orders: with one in place of the other boxes would change in their
last digits.
"""

import numpy as np

from trackmark.trackers.base.arrays import Array

_TRANSITION = np.array([[1.0, 1.0], [0.0, 1.0]])  # of (position, velocity), from frame to frame
_OF_ACCELERATION = np.array([0.5, 1.0])  # what a frame of it does to them


class ConstantVelocity:
    """Kalman filter of a point's position and velocity, one filter an axis.

    It begins where the point is exactly, `position` (axes,) [pixels], with a velocity of 0, whose
    deviations (axes,) are in pixels a frame. The acceleration is white and constant between frames,
    its deviation above 0 [pixels/frame²]. `means` (axes, 2) and `covariances` (axes, 2, 2) are
    those of position and velocity.
    """

    def __init__(
        self, position: Array, velocity_deviation: Array, acceleration_noise: float
    ) -> None:
        self.means = np.stack([position, np.zeros(len(position))], axis=1)
        self.covariances = np.zeros((len(position), 2, 2))
        self.covariances[:, 1, 1] = velocity_deviation**2
        self._noise = acceleration_noise**2 * np.outer(_OF_ACCELERATION, _OF_ACCELERATION)

    @property
    def position(self) -> Array:
        """Where the point is, shape (axes,) [pixels]."""
        return self.means[:, 0].copy()

    def predict(self) -> None:
        """Go on to the next frame."""
        self.means = self.means @ _TRANSITION.T
        self.covariances = _TRANSITION @ self.covariances @ _TRANSITION.T + self._noise

    def correct(self, measured: Array, deviations: Array) -> Array:
        """Correct by a measured position (axes,) once after a prediction; return the gains."""
        shared = self.covariances[:, :, 0]  # of position and velocity with the position
        gains = shared / (shared[:, :1] + deviations[:, np.newaxis] ** 2)
        self.means += gains * (measured - self.means[:, 0])[:, np.newaxis]
        self.covariances = self.covariances - gains[:, :, np.newaxis] * shared[:, np.newaxis]
        return gains[:, 0]


class Smoother:
    """Kalman filter of one coordinate's value and velocity, one step a frame.

    The value that it begins with is one measurement. `acceleration`, constant within a frame,
    `measurement` (of a value) and `speed` (of the velocity at the start) are standard deviations.
    """

    def __init__(
        self, value: float, velocity: float, acceleration: float, measurement: float, speed: float
    ) -> None:
        self._state = np.array([value, velocity])
        self._covariance = np.diag([measurement**2, speed**2])
        self._noise = acceleration**2 * np.array([[0.25, 0.5], [0.5, 1.0]])
        self._measurement = measurement**2

    @property
    def value(self) -> float:
        """The latest estimate."""
        return float(self._state[0])

    @property
    def velocity(self) -> float:
        """Change a frame."""
        return float(self._state[1])

    def predicted(self) -> float:
        """The next frame's value, without changing anything."""
        return float(self._state[0] + self._state[1])

    def measure(self, value: float) -> None:
        """Go on to the next frame, where this value is measured."""
        (a, b), (_, c) = self._covariance.tolist()
        # F P F' + Q with F = [[1, 1], [0, 1]].
        (qa, qb), (_, qc) = self._noise.tolist()
        a, b, c = a + 2 * b + c + qa, b + c + qb, c + qc
        gain = np.array([a, b]) / (a + self._measurement)
        before = self.predicted()
        self._state = np.array([before, self._state[1]]) + gain * (value - before)
        self._covariance = np.array(
            [[a - gain[0] * a, b - gain[0] * b], [b - gain[0] * b, c - gain[1] * b]]
        )
