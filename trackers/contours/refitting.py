"""Mixtures fitted anew to what the last frames were segmented into.

The smooth colour model that Moreno-Noguer et al. (2005, section 6) compare with, and what takes
the place of colour particles where these are to be done without.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from trackers.contours.chain import Attached, Earlier, Weighed
from trackers.contours.colour_cue import Palettes
from trackers.contours.mixture import Mixture, components_of, refined
from trackers.contours.observation import Observation

__all__ = ["Fit", "RefittedColours", "blended"]

Array: TypeAlias = NDArray[np.float64]

STEPS = 6  # of EM, from the fit of the frame before


class Fit(NamedTuple):
    """Colours of target and background in a frame, and mixtures of them on a plane."""

    target_colours: Array  # (n, 3): R, G, B in [0, 1]
    background_colours: Array
    target: Mixture
    background: Mixture

    def on(self, basis: Array) -> "Fit":
        """The same colours on another plane, shape (3, 2), fitted from these mixtures on."""
        return self.of(self.target_colours, self.background_colours, basis)

    def of(self, target_colours: Array, background_colours: Array, basis: Array) -> "Fit":
        """Other colours, fitted from these mixtures on."""
        return Fit(
            target_colours,
            background_colours,
            refined(target_colours @ basis, self.target, STEPS),
            refined(background_colours @ basis, self.background, STEPS),
        )


class RefittedColours:
    """A cue of one pair of mixtures, predicted as G(t) = (1 - a) G(t-2) + a G(t-1).

    Each G is fitted to the colours of a frame as it was segmented; a recursion over predictions
    alone would never see an image.

    The pair is yielded `count` times, so that it can be attached to so many planes. `mixing` is a,
    in (0, 1]; 1 takes the last frame's as they are. `palettes` judge.
    """

    def __init__(self, fit: Fit, count: int, mixing: float, palettes: Palettes) -> None:
        self.fits = fit, fit
        self.count = count
        self.mixing = mixing
        self.palettes = palettes

    def learn(
        self, target_colours: Array, background_colours: Array, basis: Array, moved: bool
    ) -> None:
        """Take in colours (n, 3) drawn from both, as the last frame was segmented.

        The next prediction lies on the plane of `basis` (3, 2), which may have `moved` since the
        fits so far.
        """
        last = self.fits[1].on(basis) if moved else self.fits[1]
        self.fits = last, last.of(target_colours, background_colours, basis)

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`: the prediction."""
        older, newer = self.fits
        predicted = np.concatenate(
            [
                components_of(blended(older.target, newer.target, self.mixing)),
                components_of(blended(older.background, newer.background, self.mixing)),
            ]
        )
        return np.repeat(predicted[np.newaxis], self.count, axis=0)

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        return self.palettes.weigh(observation, states, attached, earlier)

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`; what is learnt is learnt from the segmented frame."""


def blended(older: Mixture, newer: Mixture, mixing: float) -> Mixture:
    """(1 - mixing) older + mixing newer, component by component.

    Components go together so that their centroids' squared distances sum to the least; weights,
    centroids and covariances are blended. (Angles could not be: they jump.)
    """
    distances = ((newer.means[:, np.newaxis] - older.means) ** 2).sum(axis=2)
    _, partner = linear_sum_assignment(distances)
    return Mixture(
        *((1 - mixing) * old[partner] + mixing * new for old, new in zip(older, newer, strict=True))
    )
