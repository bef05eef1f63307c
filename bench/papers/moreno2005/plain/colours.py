"""x₂: mixtures of the target's and the background's colours from frame to frame (section 4.2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bench.papers.moreno2005.plain.mixtures import Mixture, components_of, refined

__all__ = ["SmoothColours", "propagated"]

Array = NDArray[np.float64]

LEAST, MOST = 2e-4, 0.15  # eigenvalues
STEPS = 6  # of EM, from the last frame's mixture on


def propagated(states: Array, settings: Any, random: np.random.Generator) -> Array:
    """The dynamic model of all components' six numbers, the target's first.

    Every number is perturbed on its own, and where dynamics are `shared` all centroids go through
    one random linear map besides, mostly a gain.
    """
    n, m, _ = states.shape
    of_target = settings.object_components
    moved = states.copy()
    if settings.colour_dynamics == "shared":
        g = random.normal(0, settings.gain_spread, n)
        jumps = random.random(n) < settings.jump_probability
        g += np.where(jumps, random.normal(0, settings.jump_spread, n), 0)
        e = random.normal(0, settings.gain_spread / 2, (n, 2, 2))
        tau = random.normal(0, settings.class_spread, (n, 2, 2))  # of target and background
        for j in range(n):
            a = np.exp(g[j]) * np.eye(2) + e[j]
            for k in range(m):
                moved[j, k, 1:3] = a @ states[j, k, 1:3] + tau[j, 0 if k < of_target else 1]
            moved[j, :, 3:5] *= np.exp(g[j])
    moved[:, :, 1:3] += random.normal(0, settings.mean_spread, (n, m, 2))
    moved[:, :, 3:5] *= np.exp(random.normal(0, settings.eigenvalue_spread, (n, m, 2)))
    moved[:, :, 0] *= np.exp(random.normal(0, settings.prior_spread, (n, m)))
    moved[:, :, 5] += random.normal(0, settings.angle_spread, (n, m))
    moved[:, :, 3:5] = np.clip(moved[:, :, 3:5], LEAST, MOST)
    for state in moved:
        state[:of_target, 0] /= state[:of_target, 0].sum()
        state[of_target:, 0] /= state[of_target:, 0].sum()
    return moved


class SmoothColours:
    """G(t) = (1 - a) G(t-2) + a G(t-1), each fitted to a frame as it was segmented (section 6).

    Parameters
    ----------
    sets : tuple of ndarray of float64, shape (n, 3)
        Colours of target and background in the first frame.
    mixtures : tuple of Mixture
        Fitted to them, on the first plane.
    a : float
        In (0, 1].
    """

    def __init__(
        self, sets: tuple[Array, ...], mixtures: tuple[Mixture, ...], mixing: float
    ) -> None:
        self._sets, self._older, self._newer = sets, mixtures, mixtures
        self._a = mixing

    def predicted(self) -> Array:
        """Components of both mixtures, the target's first, shape (m, 6)."""
        both = zip(self._older, self._newer, strict=True)
        return np.concatenate([components_of(self._blended(*pair)) for pair in both])

    def learn(self, sets: tuple[Array, ...], basis: Array, *, moved: bool) -> None:
        """Fit anew to the last frame, on a plane; `moved` where it is another than before."""
        older = self._newer
        if moved:
            older = self._fitted(self._sets, basis, older)
        self._sets, self._older, self._newer = sets, older, self._fitted(sets, basis, older)

    def _fitted(
        self, sets: tuple[Array, ...], basis: Array, start: tuple[Mixture, ...]
    ) -> tuple[Mixture, ...]:
        pairs = zip(sets, start, strict=True)
        return tuple(refined(colours @ basis, mixture, STEPS) for colours, mixture in pairs)

    def _blended(self, older: Mixture, newer: Mixture) -> Mixture:
        """Component by component, those whose centroids are near."""
        costs = ((newer.mu[:, np.newaxis] - older.mu) ** 2).sum(axis=2)
        partners = linear_sum_assignment(costs)[1]
        parts = zip(older, newer, strict=True)
        return Mixture(*((1 - self._a) * g2[partners] + self._a * g1 for g2, g1 in parts))
