"""Constant-velocity Kalman filters: one for points, one for scalars.

`ConstantVelocity` filters several axes at once and accepts measurements of infinite variance.
`ScalarSmoother` filters one number. The two classes round differently: replacing one by the other
would change the last digits of boxes.
"""

import numpy as np

from trackmark.trackers.base.arrays import Array

_TRANSITION = np.array([[1.0, 1.0], [0.0, 1.0]])  # of (position, velocity) by one frame
_OF_ACCELERATION = np.array([0.5, 1.0])  # effect of an acceleration of 1 during one frame


class ConstantVelocity:
    """Kalman filter of the position and velocity of a point, independent per axis.

    The acceleration is white noise that is constant between two frames. The attributes `means`
    (axes, 2) and `covariances` (axes, 2, 2) describe position and velocity.

    `position` ndarray (axes,): exact initial position [pixels]; the initial velocity has mean 0.
    `velocity_deviation` ndarray (axes,): standard deviation of the initial velocity [pixels/frame].
    `acceleration_noise`: standard deviation of the acceleration, above 0 [pixels/frame²].
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
        """Estimated position, shape (axes,) [pixels]."""
        return self.means[:, 0].copy()

    def predict(self) -> None:
        """Predict position and velocity in the next frame."""
        self.means = self.means @ _TRANSITION.T
        self.covariances = _TRANSITION @ self.covariances @ _TRANSITION.T + self._noise

    def correct(self, measured: Array, deviations: Array) -> Array:
        """Correct by a measured position (axes,), once per prediction; return the gains (axes,)."""
        shared = self.covariances[:, :, 0]  # of position and velocity with the position
        gains = shared / (shared[:, :1] + deviations[:, np.newaxis] ** 2)
        self.means += gains * (measured - self.means[:, 0])[:, np.newaxis]
        self.covariances = self.covariances - gains[:, :, np.newaxis] * shared[:, np.newaxis]
        return gains[:, 0]


class ScalarSmoother:
    """Kalman filter of one number and its velocity per frame.

    The initial `value` is treated as a measurement. The other parameters are the standard
    deviations of the acceleration (constant between two frames), of measurements, and of the
    initial velocity (`speed`).
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
        """Filtered value."""
        return float(self._state[0])

    @property
    def velocity(self) -> float:
        """Estimated change per frame."""
        return float(self._state[1])

    def predicted(self) -> float:
        """Return the value predicted for the next frame; the state stays unchanged."""
        return float(self._state[0] + self._state[1])

    def measure(self, value: float) -> None:
        """Advance to the next frame and correct by the value measured there."""
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
