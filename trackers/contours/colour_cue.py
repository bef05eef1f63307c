"""Cue of the colour mixtures of target and background (section 4.2).

The mixtures are particles (`ColourCue`), or one pair that is fitted to the last segmented frames
(`RefittedColours`): the smooth colour model of Moreno-Noguer et al. (2005, section 6).
"""

from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.optimize import linear_sum_assignment

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackmark.trackers.contours.mixture import Mixture, refine_mixture, to_components
from trackmark.trackers.contours.observation import Observation, Weights, weights_from_scores
from trackmark.trackers.contours.posterior import posterior_tables

MixtureScale: TypeAlias = Literal["shared", "diagonal"]

WEIGHT, MEAN, EIGENVALUES, ANGLE = 0, slice(1, 3), slice(3, 5), 5  # indices in a component (6,)

MIN_EIGENVALUE, MAX_EIGENVALUE = 2e-4, 0.15  # of colours in [0, 1]


class MixtureEvaluator:
    """Observation model of pairs of mixtures (section 5.3), used by colour cues.

    The score of a pair is the mean posterior of the target in the window minus the mean outside.
    The pair's mixtures lie on the attached plane. The evidence for later cues is the posterior of
    the frame's colours, one row per pair. The first `n_target` components belong to the target.
    `weights` and `temperature` are passed to `weights_from_scores`.
    """

    def __init__(self, n_target: int, weights: Weights, temperature: float) -> None:
        self.n_target = n_target
        self.grading: tuple[Weights, float] = weights, temperature

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`; the evidence of the previous cue is the frame's colours on planes."""
        assert attached is not None, "a plane cue precedes the colour cue in the chain"
        tables, scores = posterior_tables(
            earlier[-1].evidence,
            attached,
            states[:, : self.n_target],
            states[:, self.n_target :],
            observation.prior,
            observation.contrast,
        )
        return Weighed(weights_from_scores(scores, *self.grading), tables)


class ColourCue(ParticleCue):
    """Particle filter of pairs of mixtures: states (components, 6) with the target's first.

    The `parameters` of `moreno2005` define the dynamic model; spreads are standard deviations of
    Gaussian noise. `colour_dynamics=diagonal` adds independent noise to each number of a component.
    (The paper's full random matrix would mix units.) `shared` also applies one random linear map to
    all centroids. The map is mainly a gain, which models changes of light, with half of its noise
    in the other elements. The gain can jump, as in abrupt changes of light.
    """

    def __init__(self, start: Array, parameters: Any, palettes: MixtureEvaluator) -> None:
        super().__init__(start, parameters.colour_samples)
        self.parameters = parameters
        self.weigh = palettes.weigh
        self._n_target = palettes.n_target

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        parameters, n_target = self.parameters, self._n_target
        count, components, _ = states.shape
        moved = states.copy()
        if parameters.colour_dynamics == "shared":
            gains = generator.normal(0.0, parameters.gain_spread, count)
            jumps = generator.random(count) < parameters.jump_probability
            gains += jumps * generator.normal(0.0, parameters.jump_spread, count)
            maps = generator.normal(0.0, parameters.gain_spread / 2, (count, 2, 2))
            maps += np.exp(gains)[:, np.newaxis, np.newaxis] * np.eye(2)
            moved[:, :, MEAN] = np.einsum("nij,nmj->nmi", maps, states[:, :, MEAN])
            shifts = generator.normal(0.0, parameters.class_spread, (count, 2, 2))
            moved[:, :n_target, MEAN] += shifts[:, :1]
            moved[:, n_target:, MEAN] += shifts[:, 1:]
            moved[:, :, EIGENVALUES] *= np.exp(gains)[:, np.newaxis, np.newaxis]
        moved[:, :, MEAN] += generator.normal(0.0, parameters.mean_spread, (count, components, 2))
        moved[:, :, EIGENVALUES] *= np.exp(
            generator.normal(0.0, parameters.eigenvalue_spread, (count, components, 2))
        )
        moved[:, :, WEIGHT] *= np.exp(
            generator.normal(0.0, parameters.prior_spread, (count, components))
        )
        moved[:, :, ANGLE] += generator.normal(0.0, parameters.angle_spread, (count, components))
        np.clip(
            moved[:, :, EIGENVALUES],
            MIN_EIGENVALUE,
            MAX_EIGENVALUE,
            out=moved[:, :, EIGENVALUES],
        )
        for class_weights in (moved[:, :n_target, WEIGHT], moved[:, n_target:, WEIGHT]):
            class_weights /= class_weights.sum(axis=1, keepdims=True)
        return moved


N_EM_STEPS = 6  # EM steps from the previous frame's fit


class ColourFit(NamedTuple):
    """Colours of target and background in a frame, and their mixtures on a plane."""

    target_colours: Array  # (n, 3): R, G, B in [0, 1]
    background_colours: Array
    target: Mixture
    background: Mixture

    def refit(self, target_colours: Array, background_colours: Array, basis: Array) -> "ColourFit":
        """Return a fit of colours on a plane (3, 2), starting from this fit."""
        return ColourFit(
            target_colours,
            background_colours,
            refine_mixture(target_colours @ basis, self.target, N_EM_STEPS),
            refine_mixture(background_colours @ basis, self.background, N_EM_STEPS),
        )


class RefittedColours:
    """Cue with one pair of mixtures, predicted as G(t) = (1 - a) G(t-2) + a G(t-1).

    Each G is fitted to the colours of a segmented frame, because a recursion over predictions would
    never use an image. `count` is the number of copies of the pair, so that different planes can be
    attached. `mixing` is a in (0, 1]; 1 predicts the last frame's mixtures. `palettes` is the
    observation model.
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
        """Fit colours (n, 3) of a segmented frame on `basis`; `moved`: the plane has changed."""
        last = self.fits[1]
        if moved:
            last = last.refit(last.target_colours, last.background_colours, basis)
        self.fits = last, last.refit(target_colours, background_colours, basis)

    def sample(self, generator: np.random.Generator) -> Array:
        """Return copies of the predicted pair; see `Cue.sample`."""
        older, newer = self.fits
        pairs = (older.target, newer.target), (older.background, newer.background)
        predicted = np.concatenate(
            [to_components(blend_mixtures(*pair, self.mixing)) for pair in pairs]
        )
        return np.repeat(predicted[np.newaxis], self.count, axis=0)

    def receive(self, states: Array, weights: Array) -> None:
        """Do nothing: `learn` updates the mixtures from the segmented frame."""


def blend_mixtures(older: Mixture, newer: Mixture, mixing: float) -> Mixture:
    """Return (1 - mixing) older + mixing newer: weighted weights, means and covariances."""
    distances = ((newer.means[:, np.newaxis] - older.means) ** 2).sum(axis=2)
    _, partner = linear_sum_assignment(distances)
    return Mixture(
        *((1 - mixing) * old[partner] + mixing * new for old, new in zip(older, newer, strict=True))
    )
