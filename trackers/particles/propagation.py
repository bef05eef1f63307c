"""How particles move from one frame to the next."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["first_order", "random_walk", "uniform_noise"]

Array = NDArray[np.float64]


def uniform_noise(uniforms: Array, half_range: Array) -> Array:
    """Noise that is uniform on ± `half_range`.

    Parameters
    ----------
    uniforms : ndarray of float64, shape (n, dimensions)
        Uniform on [0, 1).
    half_range : ndarray of float64, shape (dimensions,) or (n, dimensions)
        In the units of the state.
    """
    return (2.0 * uniforms - 1.0) * half_range


def random_walk(states: Array, noise: Array) -> Array:
    """A step without memory, sₜ = sₜ₋₁ + wₜ."""
    return states + noise


def first_order(states: Array, velocities: Array, noise: Array) -> tuple[Array, Array]:
    """A step at the velocity of the one before, which the noise changes.

    vₜ = vₜ₋₁ + wₜ and sₜ = sₜ₋₁ + vₜ: noise enters once a frame, so that for the same `noise`
    the spread around the prediction is that of `random_walk`.

    Parameters
    ----------
    states, velocities, noise : ndarray of float64, shape (n, dimensions)
        Velocities and noise in units of the state a frame.

    Returns
    -------
    states, velocities : ndarray of float64, shape (n, dimensions)
        The new ones.
    """
    velocities = velocities + noise
    return states + velocities, velocities
