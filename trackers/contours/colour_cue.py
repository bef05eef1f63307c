"""Mixtures of the target's and the background's colours, as a cue (section 4.2)."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackers.contours.observation import Observation, Weights, graded
from trackers.contours.posterior import posterior_tables

__all__ = ["ColourCue", "ColourDynamics", "MixtureScale", "Palettes"]

Array: TypeAlias = NDArray[np.float64]
MixtureScale: TypeAlias = Literal["shared", "diagonal"]

WEIGHT, MEAN, EIGENVALUES, ANGLE = 0, slice(1, 3), slice(3, 5), 5  # a component's six numbers

SMALLEST_EIGENVALUE, LARGEST_EIGENVALUE = 2e-4, 0.15  # of colours in [0, 1]


@dataclass(frozen=True, slots=True)
class ColourDynamics:
    """How mixtures go on from frame to frame, in deviations of normal noise.

    Attributes
    ----------
    kind : {'shared', 'diagonal'}
        `diagonal`: each of a component's numbers on its own, which of the paper's full random
        matrix is what has consistent units. `shared`: besides, one random linear map of all
        centroids, mainly a gain, as light has it that falls on all.
    mean, shift : float
        Of a centroid, and of all centroids of a class together (`shared` alone).
    gain : float
        Of the logarithm of the gain (`shared` alone); half of it of the map's other parts.
    jump_probability, jump : float
        How often that logarithm has this deviation besides: abrupt changes of the light.
    weight, eigenvalue : float
        Of the logarithms of a component's weight and eigenvalues.
    angle : float
        Of its first direction, in radians.
    """

    kind: MixtureScale
    mean: float
    shift: float
    gain: float
    jump_probability: float
    jump: float
    weight: float
    eigenvalue: float
    angle: float

    def propagated(self, states: Array, of_target: int, generator: np.random.Generator) -> Array:
        """Draw mixtures of the next frame; the first `of_target` components are the target's.

        A state is of shape (components, 6); see `trackers.contours.mixture.components_of`.
        """
        count, components, _ = states.shape
        moved = states.copy()
        if self.kind == "shared":
            gains = generator.normal(0.0, self.gain, count)
            jumps = generator.random(count) < self.jump_probability
            gains += jumps * generator.normal(0.0, self.jump, count)
            maps = generator.normal(0.0, self.gain / 2, (count, 2, 2))
            maps += np.exp(gains)[:, np.newaxis, np.newaxis] * np.eye(2)
            moved[:, :, MEAN] = np.einsum("nij,nmj->nmi", maps, states[:, :, MEAN])
            shifts = generator.normal(0.0, self.shift, (count, 2, 2))
            moved[:, :of_target, MEAN] += shifts[:, :1]
            moved[:, of_target:, MEAN] += shifts[:, 1:]
            moved[:, :, EIGENVALUES] *= np.exp(gains)[:, np.newaxis, np.newaxis]
        moved[:, :, MEAN] += generator.normal(0.0, self.mean, (count, components, 2))
        moved[:, :, EIGENVALUES] *= np.exp(
            generator.normal(0.0, self.eigenvalue, (count, components, 2))
        )
        moved[:, :, WEIGHT] *= np.exp(generator.normal(0.0, self.weight, (count, components)))
        moved[:, :, ANGLE] += generator.normal(0.0, self.angle, (count, components))
        np.clip(
            moved[:, :, EIGENVALUES],
            SMALLEST_EIGENVALUE,
            LARGEST_EIGENVALUE,
            out=moved[:, :, EIGENVALUES],
        )
        for part in (moved[:, :of_target, WEIGHT], moved[:, of_target:, WEIGHT]):
            part /= part.sum(axis=1, keepdims=True)
        return moved


class Palettes:
    """How pairs of mixtures are judged by a frame (section 5.3); a part of colour cues.

    A pair's weight says how well the posterior of the target, with its mixtures on the attached
    plane, tells the window from what is outside. The evidence are the posteriors of the frame's
    colours, one row a pair.

    The first `of_target` components are the target's; `weights` and `temperature` are those of
    `graded`, `floor` that of `posterior`.
    """

    def __init__(self, of_target: int, weights: Weights, temperature: float, floor: float) -> None:
        self.of_target = of_target
        self.grading: tuple[Weights, float] = weights, temperature
        self.floor = floor

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`; the cue before yields planes, with the frame's colours on them."""
        if attached is None:
            raise ValueError("mixtures are judged on a plane: a cue of planes comes before them")
        tables, scores = posterior_tables(
            earlier[-1].evidence,
            attached,
            states[:, : self.of_target],
            states[:, self.of_target :],
            self.floor,
            observation.prior,
            observation.contrast,
        )
        return Weighed(graded(scores, *self.grading), tables)


class ColourCue(ParticleCue):
    """Pairs of mixtures as particles: components (components, 6), the target's first."""

    def __init__(
        self, start: Array, count: int, dynamics: ColourDynamics, palettes: Palettes
    ) -> None:
        super().__init__(start, count)
        self.dynamics = dynamics
        self.weigh = palettes.weigh
        self._of_target = palettes.of_target

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        return self.dynamics.propagated(states, self._of_target, generator)
