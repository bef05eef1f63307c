"""The proposed tracker: plane, colours and contour, each given what was seen of those before."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.moreno2005.plain import colours, planes
from bench.papers.moreno2005.plain.frame import Frame, drawn_colours
from bench.papers.moreno2005.plain.mixtures import (
    Mixture,
    components_of,
    fitted,
    posterior,
    refined,
    seen_on,
)
from bench.papers.moreno2005.plain.samples import Samples, drawn, normalised, shares, weights_of
from bench.papers.moreno2005.plain.segmenter import PlainSegmenter
from trackers.moreno2005 import Moreno2005

__all__ = ["PlainMoreno2005"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

STEPS, STEPS_ON_PLANES = 6, 2  # of EM: of all colours, and then on each plane
NEVER_QUITE_ZERO = 1e-12


class PlainMoreno2005(PlainSegmenter):
    """The tracker `moreno2005`.

    Parameters
    ----------
    seed : SeedSequence or int
        Of the random numbers.
    **parameters
        The tracker's, by its names and with its defaults.

    Attributes
    ----------
    planes, colours : Samples
        x₁ and x₂.
    """

    def __init__(self, seed: np.random.SeedSequence | int, **parameters: Any) -> None:
        super().__init__(seed, Moreno2005.Parameters(**parameters))
        if self._settings.position != "particles":
            raise ValueError("only contours whose place is that of particles are here")

    def _begin(self, sets: tuple[Array, ...], mixtures: tuple[Mixture, ...]) -> None:
        settings = self._settings
        self.planes = Samples(planes.normal_of(self.basis), settings.plane_samples)
        state = np.concatenate([components_of(mixture) for mixture in mixtures])
        self.colours = Samples(state, settings.colour_samples)
        self._refitted = colours.SmoothColours(sets, mixtures, 1.0)

    def _hypotheses(self, frame: Frame, image: Image) -> tuple[list[Array], Array]:
        bases = self._weigh_planes(frame, image)
        tables = self._weigh_colours(frame, bases)
        return tables, self._association(self.colours)

    def _weigh_planes(self, frame: Frame, image: Image) -> list[Array]:
        """Section 5.2: each plane by posteriors of W, with mixtures of its own."""
        settings, random, cue = self._settings, self._random, self.planes
        beyond = frame.around if frame.around.any() else frame.window
        colours_in = drawn_colours(image, frame.window, settings.window_points, random)
        mixture_in = fitted(colours_in, settings.window_components, random, STEPS)
        colours_out = drawn_colours(image, beyond, settings.outside_points, random)
        mixture_out = fitted(colours_out, settings.background_components, random, STEPS)
        cue.states = planes.propagated(
            cue.resampled(random), self.basis, settings.plane_spread, random
        )
        bases = [planes.basis_on(normal, self.basis) for normal in cue.states]
        differences = []
        for phi in bases:
            of_window = refined(colours_in @ phi, seen_on(mixture_in, phi), STEPS_ON_PLANES)
            of_outside = refined(colours_out @ phi, seen_on(mixture_out, phi), STEPS_ON_PLANES)
            p = posterior(frame.colours @ phi, of_window, of_outside, settings.colour_floor, 0.5)
            differences.append(frame.difference(p))
        cue.weights = weights_of(
            np.array(differences), settings.weights, settings.plane_temperature
        )
        return bases

    def _weigh_colours(self, frame: Frame, bases: list[Array]) -> list[Array]:
        """Section 5.3: each pair of mixtures on a plane drawn by the weights of these."""
        settings, random, cue = self._settings, self._random, self.colours
        if settings.colour_model == "particles":
            cue.states = colours.propagated(cue.resampled(random), settings, random)
        else:
            cue.states = np.stack([self._refitted.predicted()] * settings.colour_samples)
        cue.attached = drawn(self._association(self.planes), random.random(len(cue.states)))
        pairs = zip(cue.states, cue.attached.tolist(), strict=True)
        tables = [self._table(frame, state, bases[k]) for state, k in pairs]
        differences = np.array([frame.difference(table) for table in tables])
        cue.weights = weights_of(differences, settings.weights, settings.colour_temperature)
        return tables

    def _association(self, cue: Samples) -> Array:
        """Probabilities by which samples are attached to those of the next cue."""
        if self._settings.association == "by-weight":
            return cue.weights
        return np.full(len(cue.weights), 1 / len(cue.weights))

    def _feed_back(self, joint: Array) -> None:
        """Each cue's own weights (equation 4), or the marginals of equation 7's triples."""
        of_planes, of_colours = self.planes.weights, self.colours.weights
        if self._settings.feedback == "joint":
            of_colours = normalised(joint + NEVER_QUITE_ZERO)
            together = shares(self.colours.attached, joint, len(of_planes))
            of_planes = normalised(together + NEVER_QUITE_ZERO)
        self.planes.carried, self.colours.carried = of_planes, of_colours

    def _learn(self, image: Image, mask: Mask) -> None:
        """Mixtures of the last frame, on its best plane, where there are no samples of them."""
        if self._settings.colour_model == "particles":
            return
        sets = self._later_sets(image, mask)
        if sets:
            best = self.planes.states[self.planes.weights.argmax()]
            self._refitted.learn(sets, planes.basis_on(best, self.basis), moved=True)
