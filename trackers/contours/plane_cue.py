"""The plane of colour space in which target and background differ, as a cue (section 4.1)."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackers.contours.discriminant import basis_of, oriented, plane_normal
from trackers.contours.mixture import refined_on_planes
from trackers.contours.observation import Observation, Weights, graded
from trackers.contours.posterior import region_scores

__all__ = ["GivenPlane", "PlaneCue", "projected_colours"]

Array: TypeAlias = NDArray[np.float64]

STEPS_ON_PLANES = 2  # of EM, after a fit in three dimensions was projected


class PlaneCue(ParticleCue):
    """Normals of planes, in a random walk (section 4.1, equation 5).

    s = H s' + p, with H the identity but for noise and p noise, and its length made 1. A
    plane's weight says how well it tells the colours in the window from those outside (section
    5.2). Its evidence are the frame's colours on each plane, in the basis that `basis_of` gives it.

    Parameters
    ----------
    basis : ndarray of float64, shape (3, 2)
        That of the first frame's plane.
    count, spread : int, float
        How many planes, and the deviation of the elements of H and p; a normal has length 1.
    weights, temperature, floor
        See `graded` and, for the density of the outside that no mixture explains, `posterior`.
    """

    def __init__(
        self,
        basis: Array,
        count: int,
        spread: float,
        weights: Weights,
        temperature: float,
        floor: float,
    ) -> None:
        super().__init__(plane_normal(basis), count)
        self.basis = basis
        self.spread = spread
        self.grading: tuple[Weights, float] = weights, temperature
        self.floor = floor

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        turned = np.eye(3) + generator.normal(0.0, self.spread, (len(states), 3, 3))
        moved = np.einsum("nij,nj->ni", turned, states)
        moved += generator.normal(0.0, self.spread, states.shape)
        moved /= np.linalg.norm(moved, axis=1, keepdims=True)
        return oriented(moved, plane_normal(self.basis))

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        if observation.inside is None or observation.outside is None:
            raise ValueError("planes are weighed by sets of colours drawn in and out of a window")
        bases = basis_of(states, self.basis)
        colours = projected_colours(observation, bases)
        inside, outside = (
            refined_on_planes(side.points, side.mixture, bases, STEPS_ON_PLANES)
            for side in (observation.inside, observation.outside)
        )
        scores = region_scores(colours, inside, outside, observation.contrast, self.floor, 0.5)
        return Weighed(graded(scores, *self.grading), colours)


class GivenPlane:
    """One plane that is given, not estimated; its `normal` (3,) may be set before each frame."""

    def __init__(self, basis: Array) -> None:
        self.basis = basis
        self.normal = plane_normal(basis)

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`."""
        return self.normal[np.newaxis]

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        return Weighed(np.ones(1), projected_colours(observation, basis_of(states, self.basis)))

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`; there is nothing to learn."""


def projected_colours(observation: Observation, bases: Array) -> Array:
    """A frame's colours on planes, (planes, cells, 2), of orthonormal bases (planes, 3, 2)."""
    projected: Array = observation.cells.colours @ bases
    return projected
