"""The Kalman filter of a pose with its velocity: three filters of constant velocity."""

import numpy as np

from bench.papers.nguyen2002.plain.matching import Pose

__all__ = ["Smoother"]

TRANSITION = np.array([[1.0, 1.0], [0.0, 1.0]])
OBSERVATION = np.array([[1.0, 0.0]])
ACCELERATION = np.array([0.5, 0.5, 0.002])
MEASUREMENT = np.array([0.5, 0.5, 0.01])
SPEED = np.array([2.0, 2.0, 0.01])


class Smoother:
    """States (value, velocity) of x, y and scale.

    Parameters
    ----------
    pose, velocity : Pose
        To start with; the pose is as good as a measurement.

    Attributes
    ----------
    states : ndarray of float64, shape (3, 2, 1)
    """

    def __init__(self, pose: Pose, velocity: Pose) -> None:
        self.states = np.stack([pose, velocity], axis=1)[:, :, np.newaxis]
        self._covariances = np.stack(
            [np.diag(variances) for variances in np.stack([MEASUREMENT**2, SPEED**2], axis=1)]
        )

    @property
    def pose(self) -> Pose:
        """Smoothed pose of the last frame measured."""
        return Pose(*self.states[:, 0, 0].tolist())

    @property
    def velocity(self) -> Pose:
        """Its change a frame."""
        return Pose(*self.states[:, 1, 0].tolist())

    def predicted(self) -> Pose:
        """Pose to expect in the next frame."""
        return Pose(*(TRANSITION @ self.states)[:, 0, 0].tolist())

    def measure(self, pose: Pose) -> None:
        """Take the next frame's measured pose into account."""
        noise = np.array([[0.25, 0.5], [0.5, 1.0]])
        for i, value in enumerate(pose):
            state = TRANSITION @ self.states[i]
            p = TRANSITION @ self._covariances[i] @ TRANSITION.T + ACCELERATION[i] ** 2 * noise
            s = OBSERVATION @ p @ OBSERVATION.T + MEASUREMENT[i] ** 2
            gain = p @ OBSERVATION.T / s
            self.states[i] = state + gain * (value - OBSERVATION @ state)
            self._covariances[i] = p - gain @ OBSERVATION @ p
