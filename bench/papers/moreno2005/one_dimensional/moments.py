"""The densities of one iteration, as Fig. 1 has them."""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bench.papers.moreno2005.one_dimensional.cues import chain
from bench.papers.moreno2005.one_dimensional.settings import (
    COLOURS,
    POSITIONS,
    SETTINGS,
    course,
)
from trackers.contours.cues.chain import Hypotheses

__all__ = ["GRIDS", "Moment", "iteration"]

Array: TypeAlias = NDArray[np.float64]

SET, SAMPLES, FRAME = "B", 500, 40
"""The printed weights with middling observations; a frame of the first course, taken unseen."""

GRIDS = np.linspace(*COLOURS, 121), np.linspace(*POSITIONS, 161)
"""Colours and positions at which densities are told."""


class Moment(NamedTuple):
    """What the filters hold after a frame.

    Attributes
    ----------
    colour : ndarray of float64, shape (n,)
        p₁: density of the colour filter, on the first grid.
    position : ndarray of float64, shape (m,)
        p₂: density of the position filter, on the second.
    both : ndarray of float64, shape (m, n)
        P = p₁ p₂: density of the pairs of a position and the colour attached to it.
    truth, estimate, observed : tuple of float
        Colour and position.
    """

    colour: Array
    position: Array
    both: Array
    truth: tuple[float, float]
    estimate: tuple[float, float]
    observed: tuple[float, float]


def iteration() -> tuple[Moment, Moment]:
    """The moments before an iteration and after it."""
    setting = SETTINGS[SET]
    seen = course(setting, FRAME + 1, np.random.default_rng([0]))
    cues = chain("dependent", setting, SAMPLES, seen.start)
    generator = np.random.default_rng([0, SAMPLES, 1])
    moments = [
        _moment(cues.step(observed, generator), truth, observed)
        for truth, observed in zip(seen.truth, seen.observed, strict=True)
    ]
    return moments[-2], moments[-1]


def _moment(found: tuple[Hypotheses, ...], truth: Array, observed: Array) -> Moment:
    colours, positions = found
    attached = colours.states[positions.attached]
    return Moment(
        _density(GRIDS[0], colours.states, colours.weights).sum(axis=0),
        _density(GRIDS[1], positions.states, positions.weights).sum(axis=0),
        _density(GRIDS[1], positions.states, positions.weights).T
        @ _density(GRIDS[0], attached, np.ones(len(attached))),
        (float(truth[1]), float(truth[0])),
        (float(positions.weights @ attached), float(positions.weights @ positions.states)),
        (float(observed[1]), float(observed[0])),
    )


def _density(grid: Array, samples: Array, weights: Array) -> Array:
    """Each sample's share (samples, grid) of a kernel estimate; Silverman's width."""
    mean = np.average(samples, weights=weights)
    deviation = np.sqrt(np.average((samples - mean) ** 2, weights=weights))
    width = 1.06 * deviation * len(samples) ** -0.2
    kernels = np.exp(-0.5 * ((grid - samples[:, np.newaxis]) / width) ** 2)
    return np.asarray(weights[:, np.newaxis] * kernels / (width * np.sqrt(2 * np.pi)))
