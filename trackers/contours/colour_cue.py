"""Mixtures of the target's and the background's colours, as a cue (section 4.2).

They are particles, or a pair that is fitted anew to what the last frames were segmented into: the
smooth colour model that Moreno-Noguer et al. (2005, section 6) compare with.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.optimize import linear_sum_assignment

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackmark.trackers.contours.mixture import Mixture, refine_mixture, to_components
from trackmark.trackers.contours.observation import Observation, Weights, weights_from_scores
from trackmark.trackers.contours.posterior import posterior_tables

MixtureScale: TypeAlias = Literal["shared", "diagonal"]

WEIGHT, MEAN, EIGENVALUES, ANGLE = 0, slice(1, 3), slice(3, 5), 5  # a component's six numbers

MIN_EIGENVALUE, MAX_EIGENVALUE = 2e-4, 0.15  # of colours in [0, 1]


@dataclass(frozen=True, slots=True)
class ColourDynamics:
    """How mixtures go on from frame to frame, in deviations of normal noise.

    `diagonal`: each of a component's numbers on its own, which of the paper's full random matrix is
    what has consistent units. `shared`: besides, one random linear map of all centroids, mainly a
    gain, as light has it that falls on all.
    """

    colour_dynamics: MixtureScale
    mean_spread: float  # of a centroid
    class_spread: float  # of all centroids of a class together (`shared` alone)
    gain_spread: float  # of the gain's logarithm (`shared` alone); half of it of the map's rest
    jump_probability: float  # how often that logarithm has the next deviation besides: in abrupt
    jump_spread: float  # changes of the light
    prior_spread: float  # of the logarithm of a component's weight
    eigenvalue_spread: float  # and of its eigenvalues
    angle_spread: float  # of its first direction [radians]

    def propagated(self, states: Array, of_target: int, generator: np.random.Generator) -> Array:
        """Draw mixtures (components, 6) of the next frame; the target's come first."""
        count, components, _ = states.shape
        moved = states.copy()
        if self.colour_dynamics == "shared":
            gains = generator.normal(0.0, self.gain_spread, count)
            jumps = generator.random(count) < self.jump_probability
            gains += jumps * generator.normal(0.0, self.jump_spread, count)
            maps = generator.normal(0.0, self.gain_spread / 2, (count, 2, 2))
            maps += np.exp(gains)[:, np.newaxis, np.newaxis] * np.eye(2)
            moved[:, :, MEAN] = np.einsum("nij,nmj->nmi", maps, states[:, :, MEAN])
            shifts = generator.normal(0.0, self.class_spread, (count, 2, 2))
            moved[:, :of_target, MEAN] += shifts[:, :1]
            moved[:, of_target:, MEAN] += shifts[:, 1:]
            moved[:, :, EIGENVALUES] *= np.exp(gains)[:, np.newaxis, np.newaxis]
        moved[:, :, MEAN] += generator.normal(0.0, self.mean_spread, (count, components, 2))
        moved[:, :, EIGENVALUES] *= np.exp(
            generator.normal(0.0, self.eigenvalue_spread, (count, components, 2))
        )
        moved[:, :, WEIGHT] *= np.exp(generator.normal(0.0, self.prior_spread, (count, components)))
        moved[:, :, ANGLE] += generator.normal(0.0, self.angle_spread, (count, components))
        np.clip(
            moved[:, :, EIGENVALUES],
            MIN_EIGENVALUE,
            MAX_EIGENVALUE,
            out=moved[:, :, EIGENVALUES],
        )
        for part in (moved[:, :of_target, WEIGHT], moved[:, of_target:, WEIGHT]):
            part /= part.sum(axis=1, keepdims=True)
        return moved


class MixtureEvaluator:
    """How pairs of mixtures are judged by a frame (section 5.3); a part of colour cues.

    A pair's weight says how well the posterior of the target, with its mixtures on the attached
    plane, tells the window from what is outside. The evidence are the posteriors of the frame's
    colours, one row a pair. The first `of_target` components are the target's; `weights` and
    `temperature` are those of `weights_from_scores`, `floor` is that of `posterior`.
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
        return Weighed(weights_from_scores(scores, *self.grading), tables)


class ColourCue(ParticleCue):
    """Pairs of mixtures as particles: components (components, 6), the target's first."""

    def __init__(
        self, start: Array, count: int, dynamics: ColourDynamics, palettes: MixtureEvaluator
    ) -> None:
        super().__init__(start, count)
        self.dynamics = dynamics
        self.weigh = palettes.weigh
        self._of_target = palettes.of_target

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        return self.dynamics.propagated(states, self._of_target, generator)


STEPS = 6  # of EM, from the fit of the frame before


class ColourFit(NamedTuple):
    """Colours of target and background in a frame, and mixtures of them on a plane."""

    target_colours: Array  # (n, 3): R, G, B in [0, 1]
    background_colours: Array
    target: Mixture
    background: Mixture

    def on(self, basis: Array) -> "ColourFit":
        """The same colours on another plane, shape (3, 2), fitted from these mixtures on."""
        return self.of(self.target_colours, self.background_colours, basis)

    def of(self, target_colours: Array, background_colours: Array, basis: Array) -> "ColourFit":
        """Other colours, fitted from these mixtures on."""
        return ColourFit(
            target_colours,
            background_colours,
            refine_mixture(target_colours @ basis, self.target, STEPS),
            refine_mixture(background_colours @ basis, self.background, STEPS),
        )


class RefittedColours:
    """A cue of one pair of mixtures, predicted as G(t) = (1 - a) G(t-2) + a G(t-1).

    Each G is fitted to the colours of a frame as it was segmented; a recursion over predictions
    alone would never see an image. The pair is yielded `count` times, so that it can be attached to
    so many planes. `mixing` is a, in (0, 1]; 1 takes the last frame's as they are. `palettes`
    judge.
    """

    def __init__(
        self, fit: ColourFit, count: int, mixing: float, palettes: MixtureEvaluator
    ) -> None:
        self.fits = fit, fit
        self.count = count
        self.mixing = mixing
        self.weigh = palettes.weigh

    def learn(
        self, target_colours: Array, background_colours: Array, basis: Array, moved: bool
    ) -> None:
        """Learn colours (n, 3) of a segmented frame; the plane of `basis` may have `moved`."""
        last = self.fits[1].on(basis) if moved else self.fits[1]
        self.fits = last, last.of(target_colours, background_colours, basis)

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`: the prediction."""
        older, newer = self.fits
        pairs = (older.target, newer.target), (older.background, newer.background)
        predicted = np.concatenate(
            [to_components(blend_mixtures(*pair, self.mixing)) for pair in pairs]
        )
        return np.repeat(predicted[np.newaxis], self.count, axis=0)

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`; what is learnt is learnt from the segmented frame."""


def blend_mixtures(older: Mixture, newer: Mixture, mixing: float) -> Mixture:
    """Blend paired components (but for angles, which jump): (1 - mixing) older + mixing newer."""
    distances = ((newer.means[:, np.newaxis] - older.means) ** 2).sum(axis=2)
    _, partner = linear_sum_assignment(distances)
    return Mixture(
        *((1 - mixing) * old[partner] + mixing * new for old, new in zip(older, newer, strict=True))
    )
