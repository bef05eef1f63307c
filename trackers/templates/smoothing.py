"""A Kalman filter of constant velocity, for one coordinate of the target's place."""

import numpy as np

__all__ = ["Smoother"]


class Smoother:
    """State (value, velocity) of one coordinate, one step a frame.

    Parameters
    ----------
    value, velocity : float
        To start with; the value is one measurement, the velocity is unknown within `speed`.
    acceleration : float
        Standard deviation of the acceleration, constant within a frame.
    measurement : float
        Standard deviation of a measured value.
    speed : float
        Standard deviation of the velocity at the start.
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
        """The latest."""
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
